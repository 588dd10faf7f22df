// Checks the file that a command will write, before its work.
#pragma once
#include <string>
#include <vector>

#include "common/core/result.hpp"

namespace osteon::audio {

// A file for `what` ("the model"), which is no other file of the same command. The first of `others` is what is read.
// An empty name is always good. Error: invalid_input or internal; names file and option.
[[nodiscard]] Result<void> check_output(const std::string& file, const std::string& what, const std::string& option,
                                        const std::vector<std::string>& others);

}  // namespace osteon::audio
