// Checks the file that a command will write, before its work.
#pragma once
#include <chrono>
#include <string>
#include <vector>

#include "common/core/result.hpp"

namespace osteon::audio {

// Another file of the same command.
struct OtherFile {
  std::string file, what = "what is read";
};

// Writing `file` loses none of `others`. An empty name is no file. Error invalid_input; names file and option.
[[nodiscard]] Result<void> check_apart(const std::string& file, const std::string& option,
                                       const std::vector<OtherFile>& others);

// A file for `what` ("the model"): check_apart(), no device, and writable. An empty name is always good. Errors:
// invalid_input or internal; name file and option.
[[nodiscard]] Result<void> check_output(const std::string& file, const std::string& what, const std::string& option,
                                        const std::vector<OtherFile>& others);

// Work that shows no progress if it takes no longer.
inline constexpr std::chrono::milliseconds kQuietWork{1000};

// The error of a command that was stopped before it wrote these. Empty names are no files.
[[nodiscard]] tl::unexpected<Error> stopped_before(const std::vector<std::string>& files);

// A new folder for a command: its name is free, and it can be made. A name whose parents are missing is refused, as of
// a file: it is rather misspelt. Errors: exists, internal; name folder and option.
[[nodiscard]] Result<void> check_new_folder(const std::string& folder, const std::string& option);

}  // namespace osteon::audio
