#include "common/runtime/new_folder.hpp"

#include <unistd.h>

#include <string>

#include "common/core/replace_text.hpp"

namespace osteon {

namespace fs = std::filesystem;

Result<void> write_new_folder(const fs::path& folder, const std::function<Result<void>(const fs::path&)>& write) {
  std::error_code error;
  const fs::path target = folder.has_filename() ? folder : folder.parent_path();
  if (fs::exists(target, error))
    return failure(ErrorCode::exists, target.string() + " is already there; choose another name or remove it first");
  fs::path partial = target;
  partial += ".partial-" + std::to_string(::getpid());
  fs::create_directories(partial, error);
  if (error)
    return failure(ErrorCode::internal, "cannot make the folder " + target.string() + ": " + error.message() +
                                            "; choose a place where you may write");

  Result<void> written = write(partial);
  if (written) {
    fs::rename(partial, target, error);
    if (error) written = failure(ErrorCode::internal, "cannot write " + partial.string() + ": " + error.message());
  }
  // Users know the name that they gave.
  if (!written) replace_all(written.error().message, partial.string(), target.string());
  if (!written) fs::remove_all(partial, error);
  return written;
}

}  // namespace osteon
