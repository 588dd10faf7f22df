// Reads and writes small files. A file is written completely or not at all.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "common/core/result.hpp"

namespace osteon {

// Writes beside the target, then renames over it. Error: internal, naming the path and the system's reason.
[[nodiscard]] Result<void> write_file(const std::filesystem::path& file, std::string_view content);
// Error: not_found or internal, naming the path.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& file);
// Whether the file could be written. Its content is not changed. An empty path is always good. `what` ("the recording")
// and `option` ("--wav") are for the message. Error: internal.
[[nodiscard]] Result<void> check_writable(const std::filesystem::path& file, const std::string& what,
                                          const std::string& option);

}  // namespace osteon
