// Simulates a room from one seed: a server, its clients and all their events.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "tests/simulation/ledger.hpp"
#include "tests/simulation/sim_server.hpp"

namespace osteon::test {

struct SimulationOptions {
  bool full = false;  // a larger bone with pieces that separate and the worst networks, instead of many small runs
  Breakage breakage = Breakage::none;
};

struct SimulationReport {
  std::uint64_t seed = 0;
  std::vector<Fault> faults;
  std::uint64_t cuts = 0;                                                          // made
  std::uint64_t entries = 0, committed = 0, rejected = 0, undone = 0, splits = 0;  // in the journal
  std::uint64_t decisions = 0, forbidden = 0;  // about hands, and cuts that were refused because of them
  // undo and redo that were refused, and hands that were still restricted after a restart
  std::uint64_t denied = 0, carried = 0;
  std::uint64_t acknowledged = 0;  // entries that any client received
  std::uint64_t crashes = 0, disk_failures = 0, breaks = 0, resumed = 0, programs = 0;
  double virtual_s = 0;
  // from the end of all faults, with all clients connected, until every cut is decided and sent
  double settled_s = 0;
  double back_s = 0;       // from the end of all faults until then
  bool fast_path = false;  // offered
  DatagramCounts datagrams;
  std::vector<float> felt_by_datagram_ms, felt_by_stream_ms;  // from a cut until a partner's replica has it
  double cpu_ms = 0;
};

// Equal for equal seed and options, on every machine.
[[nodiscard]] SimulationReport simulate(std::uint64_t seed, const SimulationOptions& options = {});

}  // namespace osteon::test
