// A server that is killed again and again while two hands cut in its room: is all that it acknowledged in its journal?
#pragma once
#include <cstdint>
#include <string>

#include "common/runtime/tick_stats.hpp"

namespace osteon::test {

struct KilledServers {
  int kills = 0;
  int killed_idle = 0;                                 // nothing was acknowledged since the last kill
  std::uint64_t sent = 0, acknowledged = 0, kept = 0;  // cuts; kept: in the journal at the end
  std::uint64_t lost = 0;                              // acknowledged and not kept, or kept at another place
  std::uint64_t twice = 0, missing = 0;  // numbers of one author that the journal has twice, or leaves out
  int hashes_that_differ = 0;            // holders of the bone at the end that do not have the server's
  DurationHistogram up, back;  // from a start until it listens; from then until all hands stand in the room again
  std::string fault;           // what went wrong otherwise; empty: nothing
};

// [real processes, on the loopback] The same seed kills at the same moments, as far as a machine's load lets it.
[[nodiscard]] KilledServers kill_servers(int kills, std::uint64_t seed);

}  // namespace osteon::test
