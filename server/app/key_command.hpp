// osteon-server key: shows and changes the key with which a server signs its journals.
#pragma once
#include <functional>

#include "common/core/result.hpp"

namespace CLI {
class App;
}

namespace osteon {

// `chosen` becomes what the command line asks for, where it asks for this.
void add_key_command(CLI::App& app, std::function<Result<void>()>& chosen);

}  // namespace osteon
