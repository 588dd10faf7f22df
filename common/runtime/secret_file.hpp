// Files that one user alone should read.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

namespace osteon {

// Who else may read or write a secret file, and what to do, as a sentence that names it. Nothing: its owner alone may,
// or it is not there. A group counts only where this process could do without: the file's owner may let a server of
// another user read it as one of its group.
[[nodiscard]] std::optional<std::string> who_else_reads(const std::filesystem::path& file);

}  // namespace osteon
