// The commands for journals that no server has open: osteon-server verify, salvage, backup, migrate, branch, replay,
// export, people, erase-person and delete.
#pragma once
#include <functional>

#include "common/core/result.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds the commands to the program. Parsing sets `chosen` if one of them was given.
void add_journal_commands(CLI::App& app, std::function<Result<void>()>& chosen);

}  // namespace osteon
