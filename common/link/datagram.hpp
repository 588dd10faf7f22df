// Datagrams between endpoints: what the real UDP port and a simulated network have in common.
#pragma once
#include <compare>
#include <cstddef>
#include <cstdint>
#include <string>

namespace osteon {

// The whole payload of one datagram; below every path's usual limit, so that none is fragmented.
inline constexpr std::size_t kMostDatagramBytes = 1100;

// Where datagrams come from and go to: an address and port of IP (v4 mapped into v6), or a node of a simulated network.
struct Endpoint {
  std::uint64_t high = 0, low = 0;
  std::uint16_t port = 0;
  friend auto operator<=>(const Endpoint&, const Endpoint&) = default;
  [[nodiscard]] bool is_set() const { return port != 0; }
};
[[nodiscard]] std::string to_string(const Endpoint& endpoint);

}  // namespace osteon
