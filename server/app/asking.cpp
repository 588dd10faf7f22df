#include "server/app/asking.hpp"

#include <CLI/CLI.hpp>

#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "common/wire/door.hpp"

namespace osteon {

CLI::App* add_asking_command(CLI::App& parent, const char* name, const char* what, std::function<Result<void>()>& chosen,
                             std::function<Result<void>(RoomsClient&)> run) {
  struct Arguments {
    std::string server;
    wire::DoorArguments door;
  };
  const auto given = std::make_shared<Arguments>();  // shared by the options and by what runs
  CLI::App* sub = parent.add_subcommand(name, what);
  sub->add_option("--server", given->server, "HOST:PORT of osteon-server")->required();
  wire::add_door_options(*sub, given->door);
  sub->callback([&chosen, given, run = std::move(run)] {
    chosen = [given, run]() -> Result<void> {
      // What the server is asked may take long: Ctrl-C ends this program, and the server goes on.
      const Result<wire::Door> door = wire::door_of(given->door);
      if (!door) return tl::unexpected(door.error());
      Result<RoomsClient> client = RoomsClient::reach(given->server, std::chrono::seconds(5), {}, *door);
      if (!client) return tl::unexpected(client.error());
      return run(*client);
    };
  });
  return sub;
}

}  // namespace osteon
