// Datagrams between endpoints. The real UDP port and a simulated network share this interface.
#pragma once
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace osteon {

// Largest payload of one datagram. It is below the usual limit of every path, so that no datagram is fragmented.
inline constexpr std::size_t kMostDatagramBytes = 1100;
using DatagramBuffer = std::array<std::uint8_t, kMostDatagramBytes>;

// Where datagrams come from and go to: an IP address and port (v4 mapped into v6), or a node of a simulated network.
struct Endpoint {
  std::uint64_t high = 0, low = 0;
  std::uint16_t port = 0;
  friend auto operator<=>(const Endpoint&, const Endpoint&) = default;
  [[nodiscard]] bool is_set() const { return port != 0; }
};
[[nodiscard]] std::string to_string(const Endpoint& endpoint);

struct Datagram {
  Endpoint from;                        // as the network reports it; not authenticated
  std::span<const std::uint8_t> bytes;  // within the buffer that it was received into
};

// One socket, of a server with many peers or of a client with one. It is polled, so one loop drives a session on a real
// network and in a simulation. The loop receives what there is, but a bounded number, because of floods. It does what
// is due. Then it waits (UdpPort::wait) or advances virtual time. Sent datagrams may be lost, repeated, late or out of
// order. One thread.
class DatagramPort {
 public:
  virtual ~DatagramPort() = default;
  // At most kMostDatagramBytes. Never blocks. A datagram that cannot be sent now is lost, as on the network.
  virtual void send(const Endpoint& to, std::span<const std::uint8_t> bytes) = 0;
  // The oldest datagram that has arrived and was not taken yet; nothing if there is none. Never blocks. `into` must
  // hold kMostDatagramBytes.
  [[nodiscard]] virtual std::optional<Datagram> receive(std::span<std::uint8_t> into) = 0;
  // Where others reach this port. A port bound to the any-address returns that address.
  [[nodiscard]] virtual Endpoint local() const = 0;
};

}  // namespace osteon
