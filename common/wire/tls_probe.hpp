// Makes one connection to find out how far a connection gets. It sends no call and no ticket.
#pragma once
#include <chrono>
#include <functional>
#include <string>

#include "common/wire/x509.hpp"

namespace osteon::wire {

struct ProbeFiles {
  std::string authority, certificate, key;  // PEM; all empty: show no certificate, and accept any server's
};

struct Probe {
  enum class Reached {
    nothing,  // the name has no address
    name,     // no connection
    machine,  // a connection, but no TLS
    tls,      // TLS as far as `alert`, `verify_error` and `is_closed` say
    server,   // an HTTP/2 frame arrived over TLS
  };
  Reached reached = Reached::nothing;
  std::string system;       // why there is no address or connection, in the system's words
  bool is_refused = false;  // nothing listens on that port
  bool is_silent = false;   // nothing arrived in time
  bool is_closed = false;   // the other end closed the connection
  bool is_agreed = false;   // the TLS handshake was completed
  std::string first_bytes;  // received, unchanged
  int alert = -1;           // of TLS, received (RFC 8446, section 6); -1: none
  int verify_error = 0;     // X509_V_OK, or why the server's certificate is not accepted
  int verify_depth = 0;     // 0: the server's own certificate; above: that of an authority
  X509Ptr shown;            // the server's certificate; null: none arrived
  std::string protocol;     // that TLS agreed on (ALPN); empty: none
};

// `host`: a name or an address, without brackets. Takes at most `patience`, whatever the other end does. Checks the
// server's certificate before it shows the client's. It asks `stop` while it waits. After true it waits no longer.
[[nodiscard]] Probe probe_tls(const std::string& host, const std::string& port, const ProbeFiles& files,
                              std::chrono::milliseconds patience, const std::function<bool()>& stop = {});

}  // namespace osteon::wire
