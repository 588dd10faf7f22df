// Finds out why a client could not connect to a server, by one more connection.
#pragma once
#include <functional>
#include <string>

#include "common/core/result.hpp"
#include "common/wire/credentials.hpp"

namespace osteon::wire {

struct ConnectionFault {
  Error error;           // one sentence: what is wrong, and the remedy
  bool lasts = false;    // waiting does not help
  bool refused = false;  // nothing listens there; a server may be about to
};
// `address`: HOST:PORT, where a connection with `credentials` has just failed. Takes at most three seconds. Sends no
// call and no ticket. deploy/docs/troubleshooting.md lists the sentences. When `stop` returns true, it returns soon,
// with what it knows by then.
[[nodiscard]] ConnectionFault connection_fault(const std::string& address, const ClientCredentials& credentials,
                                               const std::function<bool()>& stop = {});

}  // namespace osteon::wire
