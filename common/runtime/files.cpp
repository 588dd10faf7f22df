#include "common/runtime/files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>

namespace osteon {

Result<void> write_file(const std::filesystem::path& file, std::string_view content) {
  std::error_code none;
  // A rename would replace a link, a device or a pipe by a file.
  const std::filesystem::path target =
      std::filesystem::is_symlink(file, none) ? std::filesystem::weakly_canonical(file, none) : file;
  if (std::filesystem::is_other(target, none))
    return failure(ErrorCode::internal, "cannot write " + file.string() + ": it is a device or a pipe; give a file");
  std::filesystem::path partial = target;
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
    const int reason = errno;
    if (!out)
      return give_up(std::strerror(reason) +
                     std::string(reason == ENOSPC ? "; make room on the disk, or choose another one" : ""));
  }
  std::error_code error;
  std::filesystem::rename(partial, target, error);
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

Result<void> check_writable(const std::filesystem::path& file, const std::string& what, const std::string& option) {
  if (file.empty()) return {};
  std::error_code ignored;
  int reason = 0;
  if (std::filesystem::is_directory(file, ignored))
    reason = EISDIR;
  else if (std::filesystem::exists(file, ignored) || std::filesystem::is_symlink(file, ignored))
    reason = ::access(file.c_str(), W_OK) != 0 ? errno : 0;
  else {
    // A folder may be writable and yet take no file, as in /proc.
    const int made = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (made >= 0) ::close(made);
    if (made < 0 || ::unlink(file.c_str()) != 0) reason = errno;
  }
  if (reason == 0) return {};
  return failure(ErrorCode::internal, "cannot write " + what + " " + file.string() + ": " +
                                          std::generic_category().message(reason) + "; give " + option +
                                          " a file in a folder that exists and may be written");
}

}  // namespace osteon
