// Where a peer is now: whose address it is believed, and how it proves another one.
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
  // An address not proven by then is forgotten, and may begin anew. No round trip may be longer.
  std::chrono::nanoseconds forgotten_after = std::chrono::seconds{1};
  std::size_t most_sent = 3;  // bytes to an address not yet proven, for each byte that came from it
};

// A server's view of one session. Addresses are written by whoever sends, so a datagram from a new one moves nothing by
// itself: it must be authentic and newer than all before, which no copy of an old one is; then a challenge goes to the
// new address, and only its echo, authentic and from there, makes it the peer's. Until then all else goes where it
// went. The first address of a session is proven in the same way. After RFC 9000, section 8.2 and 9.3. One thread.
class PathWatch {
 public:
  explicit PathWatch(FillRandom random, const PathRules& rules = {});

  // An authentic datagram of `bytes` came from `from`; `newest`: its counter is above all before (Opened::newest).
  // `now`: since any start, the same for all calls.
  void heard(const Endpoint& from, bool newest, std::size_t bytes, std::chrono::nanoseconds now);
  // An authentic datagram from `from` brought this token. True when it moved the peer there.
  bool echoed(const Endpoint& from, const PathToken& token, std::chrono::nanoseconds now);

  struct Challenge {
    Endpoint to;
    PathToken token;
  };
  // A challenge that is due, to be sent at once in a datagram of `bytes`, all counted; called at every turn of the
  // loop.
  [[nodiscard]] std::optional<Challenge> challenge_due(std::size_t bytes, std::chrono::nanoseconds now);

  // Where everything but challenges goes; not set before the first address is proven.
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
  std::uint64_t moves_ = 0;  // how often the address changed, the first one included
};

}  // namespace osteon
