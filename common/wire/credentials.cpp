#include "common/wire/credentials.hpp"

#include <grpcpp/grpcpp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <system_error>

#include "common/wire/certificate_files.hpp"
#include "common/wire/host_port.hpp"

namespace osteon::wire {
namespace {

constexpr const char* kWays =
    "--certificates DIR with --ticket FILE, as whoever runs the server gives them to you, or --plain for a server on "
    "this machine";

// Without the end of line. Empty: there is nothing, or it cannot be read.
std::string first_word(const std::filesystem::path& file) {
  std::error_code unknown;
  std::string text;
  if (std::filesystem::is_regular_file(file, unknown)) std::ifstream(file) >> text;
  return text;
}

// gRPC aborts the process if a header contains other bytes.
bool is_ascii(const std::string& text) {
  return std::ranges::all_of(text, [](char c) { return c > ' ' && c <= '~'; });
}

}  // namespace

void add_credential_options(CLI::App& app, CredentialArguments& arguments) {
  app.add_option("--certificates", arguments.certificates,
                 "Folder with ca.pem, person.pem and person.key: who the server is, and who you are");
  app.add_option("--ticket", arguments.ticket,
                 "File with the ticket that says which room you may enter, and in which role");
  app.add_flag("--plain", arguments.plain,
               "Plain text without a certificate, to a server on this machine that was started with --plain");
}

Result<ClientCredentials> client_credentials(const CredentialArguments& arguments) {
  if (arguments.plain && (!arguments.certificates.empty() || !arguments.ticket.empty()))
    return failure(ErrorCode::invalid_input, "--plain excludes --certificates and --ticket; give one or the other");
  if (arguments.plain) return ClientCredentials{};
  if (arguments.certificates.empty() || arguments.ticket.empty())
    return failure(ErrorCode::invalid_input, std::string("say how to connect to the server: ") + kWays);
  ClientCredentials credentials{.certificates = arguments.certificates, .ticket = arguments.ticket};
  const std::string ticket = first_word(credentials.ticket);
  if (ticket.empty())
    return failure(
        ErrorCode::not_found,
        credentials.ticket.string() + ", the ticket, is missing or empty; ask whoever runs " + "the server for it");
  if (!is_ascii(ticket))
    return failure(ErrorCode::invalid_input, credentials.ticket.string() +
                                                 ", the ticket, is no plain text (it may be " +
                                                 "UTF-16, or begin with a byte order mark); save it as ASCII");
  if (const Result<ProbeFiles> files = read_certificate_files(credentials.certificates); !files)
    return tl::unexpected(files.error());
  return credentials;
}

Result<std::shared_ptr<grpc::ChannelCredentials>> channel_credentials(const ClientCredentials& credentials,
                                                                      const std::string& address) {
  if (credentials.certificates.empty()) {
    if (is_loopback(address.substr(0, address.rfind(':')))) return grpc::InsecureChannelCredentials();
    return failure(ErrorCode::invalid_input, "plain text is only for a server on this machine, and " + address +
                                                 " is another; give --certificates DIR with --ticket FILE");
  }
  const Result<ProbeFiles> files = read_certificate_files(credentials.certificates);
  if (!files) return tl::unexpected(files.error());
  return grpc::SslCredentials(
      {.pem_root_certs = files->authority, .pem_private_key = files->key, .pem_cert_chain = files->certificate});
}

std::string ticket_text(const ClientCredentials& credentials) {
  const std::string ticket = credentials.ticket.empty() ? std::string() : first_word(credentials.ticket);
  return is_ascii(ticket) ? ticket : std::string();
}

}  // namespace osteon::wire
