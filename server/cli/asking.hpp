// Commands that ask a running server, such as osteon-server rooms and osteon-server cases.
#pragma once
#include <functional>

#include "common/core/result.hpp"
#include "server/cli/room_admin_client.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds the command `name` to `parent`, with --server, --timeout and the options for credentials. If it is on the
// command line, `chosen` becomes a function that connects to the server within --timeout and calls `run`; its errors
// are those of both. Returns the command, so that the caller can add options.
CLI::App* add_asking_command(CLI::App& parent, const char* name, const char* what,
                             std::function<Result<void>()>& chosen, std::function<Result<void>(RoomAdminClient&)> run);

}  // namespace osteon
