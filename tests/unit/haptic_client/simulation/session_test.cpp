// A session of a simulated surgeon: late ticks, simulated devices, a window burred to its depth.
#include "haptic_client/simulation/session.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

// The loop knows when a tick is late. After three missed ticks there is no force.
TEST(Session, LateTicksReachTheLoop) {
  PlanStep step;
  step.action = Action::drill;
  step.tool = "drill-3.2";
  step.entry.point_mm = Vec3(0, 0, 0);
  step.entry.axis = Vec3(0, 0, 1);
  Bench bench(block_case(), {step});
  for (int i = 0; i < 3000; ++i) {
    bench.tick();
    bench.follow();
  }
  ASSERT_GT(bench.tick().report.device.force_n.norm(), 5.0);
  EXPECT_GT(bench.session().tick(bench.patch(), RoomLink::follows, 3).report.device.force_n.norm(), 5.0);
  const LoopReport late = bench.session().tick(bench.patch(), RoomLink::follows, 4).report;
  EXPECT_EQ(late.device.force_n.norm(), 0.0);
  EXPECT_TRUE(late.events & kMissedTicks);
}

TEST(SimulatedDevice, IsChosenByName) {
  EXPECT_EQ(find_simulated_device("simulated")->limits.continuous_n, 30.0);
  const SimulatedDevice desktop(*find_simulated_device("simulated-3.3N"));
  EXPECT_EQ(desktop.name(), "simulated-3.3N");
  EXPECT_NEAR(loop_params(desktop.limits(), 0.0).force_scale, 0.11, 1e-12);
  const auto none = find_simulated_device("phantom");
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("simulated"), std::string::npos);
}

TEST(Burr, TakesAWindowToItsDepth) {
  PlanStep step;
  step.action = Action::burr;
  step.tool = "burr-round-5";
  step.window_u_mm = 8;
  step.window_v_mm = 7;
  step.depth_mm = 1.5;
  step.entry.point_mm = Vec3(0, 0, 0);
  step.entry.axis = Vec3(0, 0, 1);
  Bench bench(block_case(16.0), {step});
  double force_max = 0, work_min = 0;
  bool cutting = false;
  bench.run([&](const SessionTick& tick) {
    force_max = std::max(force_max, tick.report.coupling.force_n.norm());
    work_min = std::min(work_min, tick.report.cutting.force_n.dot(tick.report.contact.moved_mm));
    cutting |= tick.report.cutting.phase == CuttingPhase::cutting;
  });
  ASSERT_TRUE(bench.session().done());
  EXPECT_TRUE(cutting);
  EXPECT_GE(work_min, 0.0);
  EXPECT_GT(force_max, 0.2);
  EXPECT_LT(force_max, 20.0);
  const CutField& bone = bench.replica().predicted();
  EXPECT_GT(bone.solid_mm({0, 0, 1.0}), 0.0);    // taken away
  EXPECT_LT(bone.solid_mm({0, 0, 2.0}), 0.0);    // left
  EXPECT_LT(bone.solid_mm({6.0, 0, 0.3}), 0.0);  // outside the window
  // Closed form of a sphere swept over a rectangle: cap, half segments along the edges, slab. The hand yields a little,
  // so less is removed.
  const double r = 2.5, d = 1.5, a = 8 - 5, b = 7 - 5;
  const double cap = std::numbers::pi * d * d * (3 * r - d) / 3;
  const double segment = r * r * std::acos(1 - d / r) - (r - d) * std::sqrt(2 * r * d - d * d);
  const double whole = cap + segment * (a + b) + d * a * b;
  EXPECT_GT(bone.removed_mm3(), 0.8 * whole);
  EXPECT_LT(bone.removed_mm3(), 1.02 * whole);
}

}  // namespace
}  // namespace osteon::haptic::test
