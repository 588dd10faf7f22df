// Runs real processes with real sockets, and osteon-impair between a server and two simulated hands. Measures whether
// all end with one bone, and how soon one hand feels what the other cuts.
#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/process.hpp"

namespace osteon::test {

struct BadNetworkRun {
  std::uint64_t sent = 0, kept = 0;  // cuts of both hands; kept: decided by the server
  double converged_s = 0;            // from quiet (hands rest, network is good) until all hold one bone
  std::vector<double> felt_ms;       // from one hand's sending of each cut until it is in the other's patch
  bool fast_path_alive = false;      // of both, before quiet
  std::string fault;                 // empty: none
};

struct BadNetwork {
  std::vector<std::string> impairment{};  // arguments of osteon-impair; empty: no relay
  std::chrono::milliseconds work{1500};
  std::vector<std::string> meanwhile{};  // commands for osteon-impair, spread evenly over the work
  std::string fast_path{};               // "off": only the streams are used
};

// The UDP port that a server has written to its log. Empty if it has written none.
[[nodiscard]] std::string udp_port_of(Process& server);

[[nodiscard]] BadNetworkRun run_on(const BadNetwork& network, std::uint64_t seed);

}  // namespace osteon::test
