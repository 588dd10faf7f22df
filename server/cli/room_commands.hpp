// The commands for the rooms of a running server: osteon-server rooms list, create, close, …
#pragma once
#include <functional>

#include "common/core/result.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds the command "rooms" with its subcommands. Parsing sets `chosen` if one of them was given.
void add_room_commands(CLI::App& app, std::function<Result<void>()>& chosen);

}  // namespace osteon
