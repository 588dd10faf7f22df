// A drill in the hole that it has drilled: its play, and what it takes away.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/rendering/haptic_loop.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

// A drill in its own hole has almost no sideways play, does not jam along it, and feels nothing where it has cut.
TEST(DrillInItsHole, IsHeldSidewaysAndFreeAlongTheAxis) {
  PlanStep step;
  step.action = Action::drill;
  step.tool = "drill-3.2";
  step.hand = HandKind::rig;
  step.feed_mm_per_s = 3;  // 51 N in the cortex, less than the device's 60
  step.beyond_mm = -20;    // stops 10 mm deep
  step.entry.point_mm = Vec3(0, 0, 0);
  step.entry.axis = Vec3(0, 0, 1);
  Bench bench(block_case(), {step});
  double force_on_the_way_out = 0, deepest = 0;
  bench.run([&](const SessionTick& tick) {
    deepest = std::max(deepest, tick.report.pose_bone_proxy.position_mm.z());
    if (tick.order.phase == SurgeonPhase::retract && tick.report.pose_bone_proxy.position_mm.z() < deepest - 1.0)
      force_on_the_way_out = std::max(force_on_the_way_out, tick.report.coupling.force_n.norm());
  });
  EXPECT_NEAR(deepest, 10.0, 0.3);  // the rig turns back while the coupling is still stretched
  EXPECT_EQ(force_on_the_way_out, 0.0);

  // Put back into the hole by hand, with the spindle off.
  HapticLoop loop(LoopParams{.ramp_s = 1e-9}, {ToolModel(*find_tool("drill-3.2"), 0.5)});
  Patch patch;
  PatchBuilder builder;
  const Pose inside{{0, 0, 6}, Eigen::Quaterniond::Identity()};
  builder.build(bench.replica().committed(), loop.tool(0), inside, patch);
  loop.take_up(0, inside, WorkspaceMapping{});
  LoopInput input;
  input.pose_device_tool = inside;
  LoopReport report;
  for (int i = 0; i < 100; ++i) {
    input.pose_device_tool.position_mm.x() = 0.003 * i;
    report = loop.tick(input, patch);
  }
  EXPECT_LT(report.pose_bone_proxy.position_mm.x(), 0.13);
  EXPECT_LT(report.coupling.force_n.x(), -5.0);
  input.pose_device_tool.position_mm = {0, 0, 6};
  for (int i = 0; i < 100; ++i) {
    input.pose_device_tool.position_mm.z() = 6 + 0.03 * i;
    report = loop.tick(input, patch);
  }
  EXPECT_NEAR(report.pose_bone_proxy.position_mm.z(), 8.97, 0.1);
  EXPECT_EQ(report.coupling.force_n.norm(), 0.0);
}

// A hand at the loop whose cuts go through a replica, as late as a real client's. Device and bone frames are alike.
class HandOnBlock {
 public:
  explicit HandOnBlock(const char* tool)
      : loop_(LoopParams{.ramp_s = 1e-9}, {ToolModel(*find_tool(tool), bone_.pitch_mm())}) {
    lead({0, 0, -1});
    loop_.take_up(0, input_.pose_device_tool, WorkspaceMapping{});
    builder_.build(replica_.bodies(), loop_.tool(0), input_.pose_device_tool, patch_);
  }
  void lead(const Vec3& to) { input_.pose_device_tool.position_mm = to; }
  // Runs one tick in which the handle moves a little towards a target, so far ahead of the tool along z, and at x.
  LoopReport push(double ahead_mm, double x_mm = 0.0) {
    constexpr double kStep_mm = 0.005;
    ahead_mm_ += std::clamp(ahead_mm - ahead_mm_, -kStep_mm, kStep_mm);
    x_mm_ += std::clamp(x_mm - x_mm_, -kStep_mm, kStep_mm);
    lead(Vec3(x_mm_, 0, tip_mm().z() + ahead_mm_) - (ticks_ ? report_.coupling.offset_mm : Vec3(Vec3::Zero())));
    return tick();
  }
  LoopReport tick() {
    report_ = loop_.tick(input_, patch_);
    CutPiece piece;
    while (loop_.take_piece(piece)) replica_.add_own(cut_of(piece, loop_.tool(0), AuthorId{1}, 0));
    if (++ticks_ % 12 == 0) {
      for (const ChangedLeaves& change : replica_.take_changes())
        builder_.changed(bone_.pitch_mm(), change.level, change.origins);
      builder_.build(replica_.bodies(), loop_.tool(0), report_.pose_bone_proxy, patch_);
      patch_.own_cuts = replica_.last_own();
    }
    return report_;
  }
  [[nodiscard]] Vec3 tip_mm() const { return ticks_ ? report_.pose_bone_proxy.position_mm : Vec3(0, 0, -1); }
  void drill_to(double z_mm) {
    input_.spindle_rpm = 1000;
    for (int i = 0; i < 20'000 && tip_mm().z() < z_mm; ++i) push(0.55);
    ASSERT_GE(tip_mm().z(), z_mm);
  }

  Case bone_ = block_case();
  HapticLoop loop_;
  Replica replica_{bone_, BodyId{}};
  PatchBuilder builder_;
  Patch patch_;
  LoopInput input_;
  LoopReport report_;
  double ahead_mm_ = 0, x_mm_ = 0;
  std::int64_t ticks_ = 0;
};

// However long it is pressed, a drill that does not turn stays where it is, except for the inset of its points, and
// takes nothing away.
TEST(DrillInItsHole, TakesNothingWhileItStands) {
  HandOnBlock hand("drill-3.2");
  hand.drill_to(2.0);
  hand.input_.spindle_rpm = 0.0;
  for (int i = 0; i < 1000 && hand.report_.spindle_rpm > 1.0; ++i) hand.push(0.0);
  ASSERT_LT(hand.report_.spindle_rpm, 1.0);
  const double from_mm = hand.tip_mm().z();
  for (int i = 0; i < 100; ++i) hand.push(-0.01);  // closes the last cut
  const double removed_mm3 = hand.replica_.removed_mm3();
  for (int i = 0; i < 1000; ++i) hand.push(0.58);  // 29 N
  EXPECT_NEAR(hand.report_.coupling.force_n.z(), -29.0, 0.1);
  EXPECT_LT(hand.tip_mm().z(), from_mm + hand.loop_.tool(0).inset);
  EXPECT_EQ(hand.replica_.removed_mm3(), removed_mm3);
}

// Pulled sideways by 35 N while it drills on, it leans in its play, and its hole continues in that direction: by the
// play over the depth for each millimetre drilled. It does not cut its way sideways.
TEST(DrillInItsHole, DoesNotCreepAsideWhileItTurns) {
  HandOnBlock hand("drill-3.2");
  constexpr double kDeep_mm = 3.0;
  hand.drill_to(kDeep_mm);
  const double play_mm = hand.loop_.tool(0).inset;
  for (int i = 0; i < 1500; ++i) hand.push(0.55, 0.7);
  const double drilled_mm = hand.tip_mm().z() - kDeep_mm;
  EXPECT_GT(drilled_mm, 0.5);
  EXPECT_LT(hand.tip_mm().x(), play_mm * (3.0 + 2.0 * drilled_mm / kDeep_mm));
  EXPECT_LT(hand.report_.coupling.force_n.x(), -15.0);
}

}  // namespace
}  // namespace osteon::haptic::test
