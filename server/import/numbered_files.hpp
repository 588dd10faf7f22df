// Slices as the files of a folder, in the order of the numbers at the end of their names.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"

namespace osteon::import {

// "slice9.png" comes before "slice10.png", and "slice.9" before "slice.10". `extension`: in lower case, with its dot;
// other files are passed over. Empty: files of any extension whose names end in a number, before the extension or as
// one. `wanted`: what the folder should hold, for people. Errors: not_found (no such folder), invalid_input (no such
// files, a name without a number, a number that is missing or comes twice, several stacks).
[[nodiscard]] Result<std::vector<std::filesystem::path>> numbered_files(const std::filesystem::path& folder,
                                                                        std::string_view extension,
                                                                        const std::string& wanted);

}  // namespace osteon::import
