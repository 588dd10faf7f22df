// What osteon-server does about the rooms of a server that runs: osteon-server rooms list, create, close, …
#pragma once
#include <functional>

#include "common/core/result.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds the command "rooms" with its own; `chosen` is set when one of them is on the command line.
void add_room_commands(CLI::App& app, std::function<Result<void>()>& chosen);

}  // namespace osteon
