// Runs seeds for tests.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>

#include "common/runtime/log.hpp"
#include "tests/simulation/simulate.hpp"

namespace osteon::test {

// Hides the log of a room or journal: the faults in it are planned.
inline SimulationReport simulate_quietly(std::uint64_t seed, const SimulationOptions& options = {}) {
  static const bool open = (log::open("simulation"), true);
  (void)open;
  testing::internal::CaptureStderr();
  SimulationReport report = simulate(seed, options);
  (void)testing::internal::GetCapturedStderr();
  return report;
}

inline void expect_no_faults(const SimulationReport& report, const char* option) {
  for (const Fault& fault : report.faults)
    ADD_FAILURE() << "seed " << report.seed << ": " << name(fault.invariant) << ": " << fault.sentence
                  << "\n  again: osteon-simulate --verbose --seeds " << report.seed << option;
}

// The first of the first `seeds` seeds that finds this defect. 0: none.
inline std::uint64_t found(Breakage breakage, std::uint64_t seeds) {
  for (std::uint64_t seed = 1; seed <= seeds; ++seed)
    if (!simulate_quietly(seed, {.full = false, .breakage = breakage}).faults.empty()) return seed;
  return 0;
}

}  // namespace osteon::test
