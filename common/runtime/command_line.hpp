// Parses the arguments of a program, as every main does first.
#pragma once
#include <optional>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon {

// Parses the options of `app`. Returns an exit code if main must return at once: 0 after printing the requested help, 1
// after one sentence about wrong arguments.
[[nodiscard]] std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv);

}  // namespace osteon
