// Files that only one user should be able to read.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

namespace osteon {

// Who else can read or write a secret file, and what to do, as a sentence that names the file. Nothing if only the
// owner can, or if the file does not exist. Group access counts only if this process does not need it: the file's owner
// may let a server that runs as another user read it through its group.
[[nodiscard]] std::optional<std::string> who_else_reads(const std::filesystem::path& file);

}  // namespace osteon
