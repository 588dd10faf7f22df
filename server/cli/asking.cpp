#include "server/cli/asking.hpp"

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "common/runtime/number_option.hpp"
#include "common/wire/credentials.hpp"

namespace osteon {

CLI::App* add_asking_command(CLI::App& parent, const char* name, const char* what,
                             std::function<Result<void>()>& chosen, std::function<Result<void>(RoomAdminClient&)> run) {
  struct Arguments {
    std::string server;
    double patience_s = 5.0;
    wire::CredentialArguments credentials;
  };
  const auto given = std::make_shared<Arguments>();  // shared by the options and the function that runs
  CLI::App* sub = parent.add_subcommand(name, what);
  sub->add_option("--server", given->server, "HOST:PORT of osteon-server")->required();
  wire::add_credential_options(*sub, given->credentials);
  sub->add_option("--timeout", given->patience_s, "Seconds to wait for the server")
      ->check(number_in(0.0, 3600.0))
      ->capture_default_str();
  sub->callback([&chosen, given, run = std::move(run)] {
    chosen = [given, run]() -> Result<void> {
      // The server may take long to answer. Ctrl-C ends this program, and the server goes on.
      const Result<wire::ClientCredentials> credentials = wire::client_credentials(given->credentials);
      if (!credentials) return tl::unexpected(credentials.error());
      const std::chrono::milliseconds patience(static_cast<std::int64_t>(1000.0 * given->patience_s));
      Result<RoomAdminClient> client = RoomAdminClient::reach(given->server, patience, {}, *credentials);
      if (!client) return tl::unexpected(client.error());
      return run(*client);
    };
  });
  return sub;
}

}  // namespace osteon
