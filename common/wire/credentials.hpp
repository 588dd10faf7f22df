// How a client comes to a server: by what it proves who it is, and the channel that says so with every call.
#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "common/core/result.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}
namespace grpc {
class ChannelCredentials;
}

namespace osteon::wire {

struct ClientCredentials {
  std::filesystem::path
      certificates;              // folder with ca.pem, person.pem, person.key; empty: plain text, to this machine alone
  std::filesystem::path ticket;  // file with the ticket; read again for every call, so that it can be renewed
};

// What a program is told on its command line.
struct CredentialArguments {
  bool plain = false;
  std::filesystem::path certificates, ticket;
};
// --plain, --certificates and --ticket.
void add_credential_options(CLI::App& app, CredentialArguments& arguments);
// Errors: invalid_input (neither or both ways were given), those of read_certificate_files, not_found (no ticket); the
// sentence says what to give.
[[nodiscard]] Result<ClientCredentials> client_credentials(const CredentialArguments& arguments);

// Errors: those of read_certificate_files, invalid_input (plain text to `address`, HOST:PORT, of another machine).
[[nodiscard]] Result<std::shared_ptr<grpc::ChannelCredentials>> channel_credentials(
    const ClientCredentials& credentials, const std::string& address);
// As it goes with a call; empty where there is none to be read, or not in ASCII.
[[nodiscard]] std::string ticket_text(const ClientCredentials& credentials);

}  // namespace osteon::wire
