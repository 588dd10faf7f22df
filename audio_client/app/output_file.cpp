#include "audio_client/app/output_file.hpp"

#include <filesystem>
#include <system_error>

#include "common/runtime/files.hpp"

namespace osteon::audio {

Result<void> check_output(const std::string& file, const std::string& what, const std::string& option,
                          const std::vector<std::string>& others) {
  if (file.empty()) return {};
  std::error_code ignored;
  if (std::filesystem::is_other(file, ignored))
    return bad_input("cannot write " + what + " " + file + ": it is a device or a pipe; give " + option + " a file");
  for (const std::string& other : others)
    if (!other.empty() &&
        std::filesystem::weakly_canonical(file, ignored) == std::filesystem::weakly_canonical(other, ignored))
      return bad_input(file + " would lose " + (other == others.front() ? "what is read" : "the model") + "; give " +
                       option + " another file");
  return check_writable(file, what, option);
}

}  // namespace osteon::audio
