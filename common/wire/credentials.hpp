// The credentials of a client, and the gRPC channel that shows them with every call.
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
      certificates;              // folder with ca.pem, person.pem, person.key; empty: plain text, to this machine only
  std::filesystem::path ticket;  // file with the ticket; read again for every call, so that it can be renewed
};

// Credentials from the command line.
struct CredentialArguments {
  bool plain = false;
  std::filesystem::path certificates, ticket;
};
// Adds --plain, --certificates and --ticket.
void add_credential_options(CLI::App& app, CredentialArguments& arguments);
// Errors: invalid_input (neither or both kinds were given), those of read_certificate_files, not_found (no ticket). The
// message says what to give.
[[nodiscard]] Result<ClientCredentials> client_credentials(const CredentialArguments& arguments);

// Errors: those of read_certificate_files, invalid_input (plain text to `address`, HOST:PORT, of another machine).
[[nodiscard]] Result<std::shared_ptr<grpc::ChannelCredentials>> channel_credentials(
    const ClientCredentials& credentials, const std::string& address);
// The ticket as it is sent with a call. Empty if it cannot be read or is not ASCII.
[[nodiscard]] std::string ticket_text(const ClientCredentials& credentials);

}  // namespace osteon::wire
