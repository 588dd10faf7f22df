// Why a client got no connection to a server, found out by one more connection.
#pragma once
#include <chrono>
#include <string>

#include "common/core/result.hpp"
#include "common/wire/credentials.hpp"

namespace osteon::wire {

struct ConnectionFault {
  Error error;         // one sentence: what is wrong, and the remedy
  bool lasts = false;  // it does not go away by waiting
};
// `address`: HOST:PORT, where a connection with `credentials` has just failed. Takes at most three seconds; carries no
// call and no ticket. deploy/docs/troubleshooting.md lists the sentences.
[[nodiscard]] ConnectionFault connection_fault(const std::string& address, const ClientCredentials& credentials);

}  // namespace osteon::wire
