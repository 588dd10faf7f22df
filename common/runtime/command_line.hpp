// The start of every program's main: its arguments, or what to say of them.
#pragma once
#include <optional>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon {

// Parses into what `app` was told of. An exit code when main must return at once: 0 after printing the help that was
// asked for, 1 after one sentence on what is wrong with the arguments.
[[nodiscard]] std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv);

}  // namespace osteon
