// The commands for uploaded cases, osteon-server cases upload and list, and the process that validates an upload.
#pragma once
#include <functional>

#include "common/core/result.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds the command "cases" with its subcommands. Parsing sets `chosen` if one of them was given.
void add_case_commands(CLI::App& app, std::function<Result<void>()>& chosen);

// "check-case ARCHIVE FOLDER QUOTA", see server/upload_validation/case_check.hpp. It is not for people, so no help
// names it. Ends the process, unless the command line is another one.
void case_check_command(int argc, char** argv);

}  // namespace osteon
