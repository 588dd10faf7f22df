// What a call's connection says about its client. Over TLS this is the certificate of the handshake. A proxy on this
// machine that ended TLS says it in headers. Headers are believed only on the proxy's own Unix socket.
#pragma once
#include <string>
#include <string_view>

namespace grpc {
class ServerContextBase;
}

namespace osteon {

// The headers of the proxy: the client's certificate (DER, in base64) and its address. The proxy sets both on every
// call, and removes headers of these names that a client sent.
inline constexpr std::string_view kCertificateHeader = "osteon-client-certificate";
inline constexpr std::string_view kAddressHeader = "osteon-client-address";

struct PeerClaims {
  std::string certificate_pem;  // empty: none was shown
  std::string peer;             // of the connection, as gRPC writes it
  std::string address;          // of the client, without a port: "ipv4:10.0.0.7"
  bool by_proxy = false;        // the two come from headers, and this server has not checked the certificate
};
[[nodiscard]] PeerClaims peer_claims(const grpc::ServerContextBase& context);

}  // namespace osteon
