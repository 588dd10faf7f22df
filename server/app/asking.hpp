// Commands that ask a server which runs, as osteon-server rooms and osteon-server cases do.
#pragma once
#include <functional>

#include "common/core/result.hpp"
#include "server/net/room_admin_client.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds to `parent` the command `name` with --server and the credentials's options. Where it is on the command line,
// `chosen` becomes what reaches the server and then runs `run`; its errors are those of both. Returned for more
// options.
CLI::App* add_asking_command(CLI::App& parent, const char* name, const char* what,
                             std::function<Result<void>()>& chosen, std::function<Result<void>(RoomAdminClient&)> run);

}  // namespace osteon
