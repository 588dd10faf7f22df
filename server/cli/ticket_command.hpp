// The command osteon-server ticket: signs a ticket for somebody.
#pragma once
#include <functional>

#include "common/core/result.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon {

// Adds the command to the program. Parsing sets `chosen` if it was given.
void add_ticket_command(CLI::App& app, std::function<Result<void>()>& chosen);

}  // namespace osteon
