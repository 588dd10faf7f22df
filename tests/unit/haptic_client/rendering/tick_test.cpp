// Tests what must not depend on the steps of time and space, and the spindle in bone: it stalls under the hand and
// turns again.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

struct Felt {
  double cortex_n, medulla_n, cortex_feed, medulla_feed;
};
Felt drill(double dt_s, double pitch_mm) {
  const auto ticks = [&](double s) { return static_cast<int>(std::lround(s / dt_s)); };
  Bench bench(block_case(12.0, pitch_mm), {straight_down("drill-3.2")}, {}, 0.0, {ticks(0.012), ticks(0.025)}, dt_s);
  bench.run();
  EXPECT_TRUE(bench.session().done());
  const StepResult& result = bench.session().surgeon().results()[0];
  const Felt felt{result.near_cortex.force_n, result.medulla.force_n, result.near_cortex.feed_mm_per_s,
                  result.medulla.feed_mm_per_s};
  std::printf("  %.1f kHz, h %.2f mm: %.2f and %.2f N, %.3f and %.2f mm/s\n", 1e-3 / dt_s, pitch_mm, felt.cortex_n,
              felt.medulla_n, felt.cortex_feed, felt.medulla_feed);
  return felt;
}

TEST(Ticks, NeitherTheirRateNorThePitchIsFelt) {
  const Felt usual = drill(1e-3, 0.5);
  for (const auto& [dt_s, pitch_mm] : {std::pair{2e-3, 0.5}, {0.5e-3, 0.5}, {1e-3, 0.25}}) {
    const Felt other = drill(dt_s, pitch_mm);
    EXPECT_NEAR(other.cortex_n, usual.cortex_n, 0.03 * usual.cortex_n);
    EXPECT_NEAR(other.medulla_n, usual.medulla_n, 0.03 * usual.medulla_n);
    EXPECT_NEAR(other.cortex_feed, usual.cortex_feed, 0.03 * usual.cortex_feed);
    EXPECT_NEAR(other.medulla_feed, usual.medulla_feed, 0.03 * usual.medulla_feed);
  }
}

// A late loop shows no force for some milliseconds, and the hand goes on. Afterwards the coupling is again what the
// hand pays for. Drilling goes on as fast as before, with the hand's force.
TEST(Ticks, AStallIsOverWhenItIsOver) {
  Bench bench(block_case(), {straight_down("drill-3.2")});
  int ticks = 0, stalls = 0;
  while (!bench.session().done() && ticks < 60'000) {
    const bool stalled = ticks > 2000 && ticks % 500 < 8;
    stalls += stalled && ticks % 500 == 0;
    EXPECT_TRUE(!stalled || bench.tick(4).report.device.force_n.isZero());
    if (!stalled) bench.tick();
    bench.follow();
    ++ticks;
  }
  ASSERT_TRUE(bench.session().done());
  EXPECT_GT(stalls, 5);
  const StepResult& result = bench.session().surgeon().results()[0];
  std::printf("  %d stalls: %.2f and %.2f N, %.3f and %.2f mm/s, plunge %.2f mm\n", stalls, result.near_cortex.force_n,
              result.medulla.force_n, result.near_cortex.feed_mm_per_s, result.medulla.feed_mm_per_s, result.plunge_mm);
  // The hand's reference: 27/11 N, 0.89 and 10.7 mm/s, 6.0 mm. A stall costs or gives a little.
  EXPECT_NEAR(result.near_cortex.force_n, 27.0, 0.1 * 27.0);
  EXPECT_NEAR(result.near_cortex.feed_mm_per_s, 0.89, 0.15 * 0.89);
  EXPECT_NEAR(result.far_cortex.feed_mm_per_s, 0.89, 0.15 * 0.89);
  EXPECT_TRUE(result.broke_through);
  EXPECT_NEAR(result.plunge_mm, 6.0, 0.15 * 6.0);
}

// A motor of 5 N mm, an eightieth of a drill's, under a hand that pushes with 27 N. It stalls in the bone and nothing
// advances. When drawn back it turns again. The own motor of a sharp, clean drill never stalls under a hand. A bur's
// does: see tool_effects_test.cpp.
TEST(Ticks, ASpindleStallsInBoneAndTurnsAgain) {
  const Case bone = block_case();
  ReadyPlan plan = *make_ready({straight_down("drill-3.2")}, bone);
  plan.tools[0].spindle.most_nmm = 5.0;
  Bench bench(bone, std::move(plan));
  int stood = 0;
  double advanced_mm = 0.0, again_rpm = 0.0, last_mm = 0.0, pushed_n = 0.0, least_rpm = 1e9, torque_nmm = 0.0;
  int pushing = 0;
  bench.run([&](const SessionTick& tick) {
    const LoopReport& r = tick.report;
    if (tick.order.phase == SurgeonPhase::push && (r.events & kStalled)) {
      if (stood++ > 100) advanced_mm += std::abs(r.pose_bone_proxy.position_mm.z() - last_mm);
      pushed_n = std::max(pushed_n, r.coupling.force_n.norm());
      EXPECT_LT(r.spindle_rpm, 1.0);
    }
    if (tick.order.phase == SurgeonPhase::push) {
      ++pushing;
      least_rpm = std::min(least_rpm, r.spindle_rpm);
      torque_nmm = std::max(torque_nmm, r.cutting.torque_nmm);
    }
    last_mm = r.pose_bone_proxy.position_mm.z();
    if (tick.order.phase == SurgeonPhase::retract) again_rpm = std::max(again_rpm, r.spindle_rpm);
  });
  EXPECT_GT(stood, 10'000) << pushing << " ticks of pushing, down to " << least_rpm << " rpm, " << torque_nmm
                           << " N mm, " << last_mm << " mm";
  EXPECT_NEAR(pushed_n, 29.0, 3.0);
  EXPECT_LT(advanced_mm, 0.2);  // all motion of a minute, in both directions, added
  EXPECT_GT(again_rpm, 60.0);
}

}  // namespace
}  // namespace osteon::haptic::test
