#include "server/auth/peer_claims.hpp"

#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <iterator>

#include "server/auth/connections.hpp"

namespace osteon {
namespace {

constexpr std::string_view kUnixPeer = "unix:";
constexpr std::size_t kMostCertificateChars = 8192;

// The value of a header that came once; otherwise empty.
std::string_view header(const grpc::ServerContextBase& context, std::string_view name) {
  const auto [first, last] = context.client_metadata().equal_range({name.data(), name.size()});
  if (first == last || std::next(first) != last) return {};
  return {first->second.data(), first->second.size()};
}

// PEM from base64 without lines (RFC 7468).
std::string to_pem(std::string_view base64) {
  constexpr std::size_t kLine = 64;
  if (base64.empty() || base64.size() > kMostCertificateChars) return {};
  std::string pem = "-----BEGIN CERTIFICATE-----\n";
  for (std::size_t at = 0; at < base64.size(); at += kLine) pem += std::string(base64.substr(at, kLine)) + "\n";
  return pem + "-----END CERTIFICATE-----\n";
}

}  // namespace

PeerClaims peer_claims(const grpc::ServerContextBase& context) {
  PeerClaims claims;
  claims.peer = context.peer();
  if (claims.peer.starts_with(kUnixPeer)) {
    claims.by_proxy = true;
    claims.certificate_pem = to_pem(header(context, kCertificateHeader));
    claims.address = header(context, kAddressHeader);
    return claims;
  }
  const auto pem = context.auth_context()->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
  if (pem.size() == 1) claims.certificate_pem.assign(pem[0].data(), pem[0].size());
  claims.address = address_of(claims.peer);
  return claims;
}

}  // namespace osteon
