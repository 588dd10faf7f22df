// Kills a server again and again while two hands cut in its room. Checks that everything acknowledged is in its
// journal.
#pragma once
#include <cstdint>
#include <string>

#include "common/runtime/tick_stats.hpp"

namespace osteon::test {

struct KilledServers {
  int kills = 0;
  int killed_idle = 0;                                 // kills with nothing acknowledged since the hands came back
  std::uint64_t sent = 0, acknowledged = 0, kept = 0;  // cuts; kept: in the journal at the end
  // acknowledged and not in the journal, or there with another sequence number
  std::uint64_t lost = 0;
  std::uint64_t twice = 0, missing = 0;  // author sequence numbers that the journal has twice, or lacks
  int hashes_that_differ = 0;            // holders of the bone at the end whose hash differs from the server's
  DurationHistogram up, back;  // from a start until it listens; from then until all hands are in the room again
  std::string fault;           // any other fault; empty: none
};

// [real processes, on the loopback] The same seed kills at the same moments, as far as the machine's load allows.
[[nodiscard]] KilledServers kill_servers(int kills, std::uint64_t seed);

}  // namespace osteon::test
