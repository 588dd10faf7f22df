// A short run of what tests/perf measures over a million ticks. The coupling gives the hand no more energy than it got,
// on devices with three and with six axes.
#include "tests/support/stability/stability.hpp"
#include "tests/support/trials.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <tuple>
#include <vector>

namespace osteon::test {
namespace {

class Stability : public ::testing::TestWithParam<std::tuple<int, int, bool>> {};

TEST_P(Stability, TheCouplingGivesNothingAway) {
  StabilityRun run;
  run.scene = static_cast<StabilityScene>(std::get<0>(GetParam()));
  run.delay_ms = std::get<1>(GetParam());
  run.six_axes = std::get<2>(GetParam());
  run.ticks = trials(40'000, 20'000);  // rig and hand, on a strong device and on a weak one
  const StabilityResult r = run_stability(run);
  std::printf(
      "  %s, %d ms: %llu contacts, generated %.4f mJ, worst %.5f, net %.1f, cutting %.1f; steps over %.3f N, still "
      "%.3f N, "
      "falls %.2f N; "
      "motor %.2f N; uncovered %lld, held back %lld, returned %lld; %lld of %lld cutting ticks pushed back, %.4f mJ at "
      "most\n",
      name(run.scene), run.delay_ms, static_cast<unsigned long long>(r.episodes), r.generated_mj, r.worst_mj, r.net_mj,
      r.cutting_mj, r.step_over_n, r.still_step_n, r.fall_n, r.motor_most_n, static_cast<long long>(r.uncovered),
      static_cast<long long>(r.held_back), static_cast<long long>(r.returned), static_cast<long long>(r.pushed_back),
      static_cast<long long>(r.cutting), r.pushed_back_most_mj);
  if (run.six_axes)
    std::printf("    and torque: %.1f mJ put in by turning, %.0f N mm at most, of the cut %.1f; slew limited %lld\n",
                r.turned_mj, r.torque_most_nmm, r.cut_most_nmm, static_cast<long long>(r.slew_limited));
  EXPECT_LE(r.worst_mj, 0.01);
  EXPECT_LE(r.generated_mj, 1.0);
  // True by construction: any other tick becomes a rubbing one. The test checks that those are few, so that means over
  // cutting ticks hold to a hundredth.
  EXPECT_GE(r.least_cutting_n_mm, 0.0);
  EXPECT_LE(r.pushed_back, r.cutting / 100);
  EXPECT_LE(r.step_over_n, 1e-9);
  EXPECT_LE(r.still_step_n, 0.5 + 1e-9);
  EXPECT_GT(r.late, 50);
  EXPECT_LE(r.motor_over_n, 1e-9);
  EXPECT_EQ(r.motor_late_n, 0.0);
  EXPECT_LE(r.turn_step_over_n, 1e-9);
  EXPECT_LE(r.cut_step_over_n, 1e-9);
  EXPECT_LE(r.cut_over_nmm, 1e-9);
  EXPECT_EQ(r.cut_late_nmm, 0.0);
  EXPECT_LE(r.torque_over_nmm, 1e-9);
  EXPECT_EQ(r.allocations, 0);
  // Otherwise the test would prove nothing.
  EXPECT_GT(r.touching, 2'000);
  EXPECT_GT(r.force_most_n, 2.0);
  EXPECT_LT(r.uncovered, r.ticks / 100);
  if (run.scene == StabilityScene::cavity || run.scene == StabilityScene::burr || run.scene == StabilityScene::drill) {
    EXPECT_GT(r.cutting, 1'000);
    EXPECT_GT(r.motor_most_n, 0.05);
  }
  if (run.six_axes) {
    EXPECT_GT(r.torque_most_nmm, 20.0);
    if (run.scene == StabilityScene::drill) {  // its shank is in its hole
      EXPECT_GT(r.turned_mj, 20.0);
      EXPECT_GT(r.cut_most_nmm, 10.0);
    }
  } else {
    EXPECT_EQ(r.torque_most_nmm, 0.0);
  }
  if (run.scene == StabilityScene::thin_wall) {
    EXPECT_LT(r.deepest_mm, 0.3);
  } else {
    EXPECT_GT(r.undone, 20u);
  }
}

// Every scene with both delays, each with three and with six axes. By day with each delay and with each number of axes
// once.
std::vector<std::tuple<int, int, bool>> runs() {
  std::vector<std::tuple<int, int, bool>> found;
  for (int scene = 0; scene < kStabilityScenes; ++scene)
    for (const int delay_ms : {0, 100})
      for (const bool six_axes : {false, true})
        if (all_trials() || six_axes == ((scene % 2 == 0) == (delay_ms == 0)))
          found.emplace_back(scene, delay_ms, six_axes);
  return found;
}

INSTANTIATE_TEST_SUITE_P(Scenes, Stability, ::testing::ValuesIn(runs()));

}  // namespace
}  // namespace osteon::test
