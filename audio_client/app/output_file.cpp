#include "audio_client/app/output_file.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "common/runtime/files.hpp"

namespace osteon::audio {

namespace fs = std::filesystem;

Result<void> check_apart(const std::string& file, const std::string& option, const std::vector<OtherFile>& others) {
  if (file.empty()) return {};
  std::error_code ignored;
  const fs::path place = fs::weakly_canonical(file, ignored);
  const auto lost = std::ranges::find_if(others, [&](const OtherFile& other) {
    return !other.file.empty() && place == fs::weakly_canonical(other.file, ignored);
  });
  if (lost == others.end()) return {};
  return bad_input(file + " would lose " + lost->what + "; give " + option + " another file");
}

Result<void> check_output(const std::string& file, const std::string& what, const std::string& option,
                          const std::vector<OtherFile>& others) {
  if (file.empty()) return {};
  std::error_code ignored;
  if (fs::is_other(file, ignored))
    return bad_input("cannot write " + what + " " + file + ": it is a device or a pipe; give " + option + " a file");
  if (auto apart = check_apart(file, option, others); !apart) return apart;
  return check_writable(file, what, option);
}

tl::unexpected<Error> stopped_before(const std::vector<std::string>& files) {
  std::string names;
  int count = 0;
  for (const std::string& file : files)
    if (!file.empty()) names += (count++ == 0 ? "" : " and ") + file;
  return failure(ErrorCode::cancelled, names.empty()
                                           ? std::string("stopped; nothing was written")
                                           : "stopped; " + names + (count > 1 ? " were" : " was") + " not written");
}

Result<void> check_new_folder(const std::string& folder, const std::string& option) {
  std::error_code ignored;
  const fs::path path(folder), target = path.has_filename() ? path : path.parent_path();
  if (fs::exists(target, ignored))
    return failure(ErrorCode::exists,
                   folder + " is already there; give " + option + " another name or remove it first");
  const fs::path parent = target.has_parent_path() ? target.parent_path() : fs::path(".");
  int reason = fs::is_directory(parent, ignored) ? 0 : ENOENT;
  if (reason == 0 && ::access(parent.c_str(), W_OK | X_OK) != 0) reason = errno;
  if (reason == 0) return {};
  return failure(ErrorCode::internal, "cannot make the folder " + folder + ": " +
                                          std::generic_category().message(reason) + "; give " + option +
                                          " a name in a folder that exists and in which you may write");
}

}  // namespace osteon::audio
