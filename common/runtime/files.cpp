#include "common/runtime/files.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

namespace osteon {

Result<void> write_file(const std::filesystem::path& file, std::string_view content) {
  std::filesystem::path partial = file;
  partial += ".partial-" + std::to_string(::getpid());
  const auto give_up = [&](const std::string& reason) -> Result<void> {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    return failure(ErrorCode::internal, "cannot write " + file.string() + ": " + reason);
  };
  {
    std::ofstream out(partial, std::ios::binary | std::ios::trunc);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    out.flush();
    if (!out) return give_up(std::strerror(errno));
  }
  std::error_code error;
  std::filesystem::rename(partial, file, error);
  if (error) return give_up(error.message());
  return {};
}

Result<std::string> read_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return failure(ErrorCode::not_found, "cannot open " + file.string() + ": " + std::strerror(errno));
  std::ostringstream content;
  content << in.rdbuf();
  if (!in) return failure(ErrorCode::internal, "cannot read " + file.string());
  return std::move(content).str();
}

}  // namespace osteon
