#include "common/wire/host_port.hpp"

#include <charconv>
#include <system_error>

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

bool is_loopback(const std::string& host) {
  if (host == "localhost" || host == "[::1]") return true;
  // Four numbers: a name or a longer text is not taken for an address.
  int parts[4] = {};
  const char *at = host.data(), *last = at + host.size();
  for (int i = 0; i < 4; ++i) {
    const auto [end, error] = std::from_chars(at, last, parts[i]);
    if (error != std::errc{} || parts[i] < 0 || parts[i] > 255) return false;
    at = end;
    if (i < 3 && (at == last || *at++ != '.')) return false;
  }
  return at == last && parts[0] == 127;
}

}  // namespace osteon
