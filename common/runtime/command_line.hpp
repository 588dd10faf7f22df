// Command lines of all programs: parsing, --version, and help that fits a terminal.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon {

inline constexpr std::size_t kHelpColumns = 100;  // widest line of a help text, characters

// Parses the arguments into what `app` was given, which has --help and --version afterwards. Returns an exit code where
// main must return at once: 0 after it has printed the help or the version, 1 after one sentence on what is wrong, with
// the command whose help says more. From
// then on a file beyond the shell's limit (ulimit -f) is an error of its write, and no signal ends the program.
[[nodiscard]] std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv);

// `text` broken at blanks into lines of at most `columns` characters. Each line but the first begins with `indent`
// blanks; the first has `used` columns in front of it already. Line breaks in `text` stay.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t columns, std::size_t indent, std::size_t used);

}  // namespace osteon
