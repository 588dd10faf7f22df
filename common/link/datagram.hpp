// Datagrams between endpoints: what the real UDP port and a simulated network have in common.
#pragma once
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace osteon {

// The whole payload of one datagram; below every path's usual limit, so that none is fragmented.
inline constexpr std::size_t kMostDatagramBytes = 1100;
using DatagramBuffer = std::array<std::uint8_t, kMostDatagramBytes>;

// Where datagrams come from and go to: an address and port of IP (v4 mapped into v6), or a node of a simulated network.
struct Endpoint {
  std::uint64_t high = 0, low = 0;
  std::uint16_t port = 0;
  friend auto operator<=>(const Endpoint&, const Endpoint&) = default;
  [[nodiscard]] bool is_set() const { return port != 0; }
};
[[nodiscard]] std::string to_string(const Endpoint& endpoint);

struct Datagram {
  Endpoint from;                        // as the network says; nobody vouches for it
  std::span<const std::uint8_t> bytes;  // within the buffer that it was received into
};

// One socket, of a server with many peers or of a client with one. It is polled, so that one loop drives a session on a
// real network and in a simulation alike: receive what there is (a bounded number, as there are floods), do what is
// due, then wait (UdpPort::wait) or let virtual time go on. What is sent may be lost, repeated, late or out of order.
// One thread.
class DatagramPort {
 public:
  virtual ~DatagramPort() = default;
  // At most kMostDatagramBytes. Never blocks; what cannot be sent now is lost, as on the way.
  virtual void send(const Endpoint& to, std::span<const std::uint8_t> bytes) = 0;
  // The oldest that has arrived and was not yet taken; nothing when there is none. Never blocks. `into`:
  // kMostDatagramBytes.
  [[nodiscard]] virtual std::optional<Datagram> receive(std::span<std::uint8_t> into) = 0;
  // Where others reach it; a port bound to any address says the address that it is bound to.
  [[nodiscard]] virtual Endpoint local() const = 0;
};

}  // namespace osteon
