// osteon-server verify, recover, backup, migrate, branch, replay, export, people, forget and delete: what is done to
// journals that no server has open.
#pragma once
#include <functional>

#include "common/core/result.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds them to the program. `chosen` is set by parsing where one was given.
void add_journal_commands(CLI::App& app, std::function<Result<void>()>& chosen);

}  // namespace osteon
