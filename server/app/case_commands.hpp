// What osteon-server does about cases that are uploaded: osteon-server cases upload, list; and the process that looks
// one through.
#pragma once
#include <functional>
#include <optional>

#include "common/core/result.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds the command "cases" with its own; `chosen` is set when one of them is on the command line.
void add_case_commands(CLI::App& app, std::function<Result<void>()>& chosen);

// "check-case ARCHIVE FOLDER QUOTA", see server/upload_validation/case_check.hpp: not for people, so that no help names
// it. The exit code, or nothing where the command line is another.
[[nodiscard]] std::optional<int> case_check_command(int argc, char** argv);

}  // namespace osteon
