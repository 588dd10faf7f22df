#include "server/net/host_port.hpp"

#include <charconv>
#include <system_error>

#include "common/wire/credentials.hpp"

namespace osteon {

Result<HostPort> parse_host_port(const std::string& text, const std::string& option) {
  const std::size_t colon = text.rfind(':');
  HostPort out;
  if (colon != std::string::npos) {
    out.host = text.substr(0, colon);
    const char *first = text.data() + colon + 1, *last = text.data() + text.size();
    const auto [end, error] = std::from_chars(first, last, out.port);
    if (error == std::errc{} && end == last && out.port >= 0 && out.port <= 65535 && !out.host.empty()) return out;
  }
  return failure(ErrorCode::invalid_input, option + " " + text + " is not HOST:PORT with a port from 0 to 65535");
}

bool is_loopback(const std::string& host) { return wire::is_loopback(host); }

}  // namespace osteon
