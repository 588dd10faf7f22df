// Network addresses as options give them: HOST:PORT.
#pragma once
#include <string>

#include "common/core/result.hpp"

namespace osteon {

struct HostPort {
  std::string host;  // as it was given: a name, four numbers, or [IPv6]
  int port = 0;      // 0: the system chooses
};

// `option` ("--listen") is for the sentence. Error invalid_input: not HOST:PORT with a port from 0 to 65535.
[[nodiscard]] Result<HostPort> parse_host_port(const std::string& text, const std::string& option);
// Whether only this machine reaches it: localhost, [::1] or four numbers that begin with 127.
[[nodiscard]] bool is_loopback(const std::string& host);

}  // namespace osteon
