// Text on its way to people: into an error, a log line, a status.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace osteon {

inline constexpr std::size_t kMostErrorBytes = 4096;

// The text with a space for each control character, so that it stays one line and does nothing to a terminal. What is
// longer than `most` bytes ends in " ...", and no letter of UTF-8 is cut in halves.
[[nodiscard]] std::string bounded_text(std::string_view text, std::size_t most = kMostErrorBytes);

// The text for people elsewhere: of each path its last name alone, and no process id of a file that is being written.
// What is between two spaces and has a slash is taken for a path.
[[nodiscard]] std::string without_paths(std::string_view text);

}  // namespace osteon
