#include "audio_client/app/output_file.hpp"

#include <filesystem>
#include <system_error>

#include "common/runtime/files.hpp"

namespace osteon::audio {

namespace fs = std::filesystem;

Result<void> check_apart(const std::string& file, const std::string& option, const std::vector<OtherFile>& others) {
  if (file.empty()) return {};
  std::error_code ignored;
  const fs::path place = fs::weakly_canonical(file, ignored);
  for (const OtherFile& other : others)
    if (!other.file.empty() && place == fs::weakly_canonical(other.file, ignored))
      return bad_input(file + " would lose " + other.what + "; give " + option + " another file");
  return {};
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

}  // namespace osteon::audio
