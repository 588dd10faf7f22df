// One connection that only finds out how far a connection gets. It carries no call and no ticket.
#pragma once
#include <chrono>
#include <string>

#include "common/wire/x509.hpp"

namespace osteon::wire {

struct ProbeFiles {
  std::string authority, certificate, key;  // PEM; all empty: no certificate is shown, and any server's is taken
};

struct Probe {
  enum class Reached {
    nothing,  // the name has no address
    name,     // no connection
    machine,  // a connection, and no TLS
    tls,      // TLS up to what `alert`, `verify_error` and `closed` say
    server,   // an HTTP/2 frame came over TLS
  };
  Reached reached = Reached::nothing;
  std::string system;       // why there is no address or connection, in the system's words
  bool is_refused = false;  // the machine says that nothing listens
  bool is_silent = false;   // nothing came in time
  bool is_closed = false;   // the other end closed the connection
  bool is_agreed = false;   // the handshake of TLS came to its end
  std::string first_bytes;  // that came, as they came
  int alert = -1;           // of TLS that came (RFC 8446, section 6); -1: none
  int verify_error = 0;     // X509_V_OK, or why the server's certificate is not taken
  int verify_depth = 0;     // 0: its own; above: that of an authority
  X509Ptr shown;            // the server's certificate; null: none came
  std::string protocol;     // that TLS agreed on (ALPN); empty: none
};

// `host`: a name or an address, without brackets. Takes at most `patience`, whatever the other end does. The server's
// certificate is judged before the client's is shown.
[[nodiscard]] Probe probe_tls(const std::string& host, const std::string& port, const ProbeFiles& files,
                              std::chrono::milliseconds patience);

}  // namespace osteon::wire
