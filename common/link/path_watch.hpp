// Tracks the address of a peer, and how the peer proves a new address.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/link/datagram.hpp"
#include "common/link/random_bytes.hpp"

namespace osteon {

using PathToken = std::array<std::uint8_t, 16>;

struct PathRules {
  std::chrono::nanoseconds retry_after = std::chrono::milliseconds{200};
  int tries = 3;  // challenges to one address
  // An unproven address is forgotten after this time, and may start again. No round trip may be longer.
  std::chrono::nanoseconds forgotten_after = std::chrono::seconds{1};
  std::size_t most_sent = 3;  // bytes sent to an unproven address, for each byte received from it
};

// A server's view of one session. The sender writes its own address, so a datagram from a new address changes nothing
// by itself. It must be authentic and newer than all before; a copy of an old datagram is not newer. Then a challenge
// goes to the new address. Only its echo, authentic and from that address, makes it the peer's address. Until then
// everything else goes to the old address. The first address of a session is proven in the same way. Follows RFC 9000,
// sections 8.2 and 9.3. One thread.
class PathWatch {
 public:
  explicit PathWatch(FillRandom random, const PathRules& rules = {});

  // An authentic datagram of `bytes` came from `from`. `newest`: its counter is above all before (Opened::newest).
  // `now`: since any start, the same for all calls.
  void received(const Endpoint& from, bool newest, std::size_t bytes, std::chrono::nanoseconds now);
  // An authentic datagram from `from` contained this token. True if the peer's address changed to `from`.
  bool echoed(const Endpoint& from, const PathToken& token, std::chrono::nanoseconds now);

  struct Challenge {
    Endpoint to;
    PathToken token;
  };
  // A challenge that is due. Send it at once, in a datagram of `bytes` bytes in total. Call this in every turn of the
  // loop.
  [[nodiscard]] std::optional<Challenge> challenge_due(std::size_t bytes, std::chrono::nanoseconds now);

  // Destination of everything but challenges. Not set before the first address is proven.
  [[nodiscard]] const Endpoint& address() const { return address_; }
  [[nodiscard]] std::uint64_t moves() const { return moves_; }

 private:
  struct Candidate {
    Endpoint address;
    PathToken token;
    std::size_t received = 0, sent = 0;  // bytes
    int tries = 0;
    std::chrono::nanoseconds next_try{}, forgotten_at{};
  };
  void forget_unproven(std::chrono::nanoseconds now);

  const FillRandom random_;
  const PathRules rules_;
  Endpoint address_;
  std::optional<Candidate> candidate_;
  std::uint64_t moves_ = 0;  // changes of the address, including the first address
};

}  // namespace osteon
