// The cuts of a bur that a simulated hand moves to and fro over a block, as the haptic loop closes them. They are made
// once, on virtual time, and then sent to rooms at the loop's own rate.
#pragma once
#include <chrono>
#include <vector>

#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::test {

inline constexpr std::chrono::milliseconds kCutsApart{haptic::CutRecorder::kTicksPerCut};  // while the tool cuts

// On haptic::test::block_case(40). The cuts have no author and no lease yet.
[[nodiscard]] inline std::vector<Cut> burred_stroke(double seconds) {
  haptic::PlanStep step;
  step.action = haptic::Action::burr;
  step.tool = "burr-round-5";
  step.tremor_mm = 0.1;
  step.window_u_mm = 24;
  step.window_v_mm = 24;
  step.depth_mm = 8;
  step.sweep_mm_per_s = 15;
  step.entry.point_mm = Vec3(0, 0, 0);
  step.entry.axis = Vec3(0, 0, 1);
  haptic::test::Bench bench(haptic::test::block_case(40), {step});
  const auto enough = static_cast<std::size_t>(seconds / std::chrono::duration<double>(kCutsApart).count());
  while (!bench.session().done() && bench.cuts().size() < enough) {
    (void)bench.tick();
    bench.follow();
  }
  return bench.cuts();
}

}  // namespace osteon::test
