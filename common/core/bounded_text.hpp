// Makes text safe to show: in an error, a log line or a status.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace osteon {

inline constexpr std::size_t kMostErrorBytes = 4096;

// The text with a space for each byte of a control character, and "?" for each byte that belongs to no UTF-8 character.
// So it stays one line, does nothing to a terminal, and fits into JSON. A text longer than `most` bytes ends in " ...",
// and no character is split.
[[nodiscard]] std::string bounded_text(std::string_view text, std::size_t most = kMostErrorBytes);

// The text for people elsewhere. Each path is reduced to its last name, and the process id in the name of a file being
// written is removed. A word between spaces that has a slash counts as a path.
[[nodiscard]] std::string without_paths(std::string_view text);

}  // namespace osteon
