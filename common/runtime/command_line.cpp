#include "common/runtime/command_line.hpp"

#include <CLI/CLI.hpp>

#include "common/runtime/log.hpp"

namespace osteon {

std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    // The library treats help as an "error" of code 0.
    if (error.get_exit_code() == 0) return app.exit(error);
    return log::exit_with(
        app.get_name(), {ErrorCode::invalid_input, std::string(error.what()) + "; see " + app.get_name() + " --help"});
  }
}

}  // namespace osteon
