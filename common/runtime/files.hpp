// Small files written whole or not at all.
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

}  // namespace osteon
