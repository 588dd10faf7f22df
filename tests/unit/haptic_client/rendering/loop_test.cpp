// The loop's duties towards hand and bone: clutch, limits, walls, lost connections, rejected cuts, workspace.
#include "haptic_client/rendering/haptic_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/volume/cut_field.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/prediction/confirmation_monitor.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

// A drill held over the middle of the block's face. Device and bone frames are alike: the handle's position is the
// tip's.
class LoopOnBlock : public ::testing::Test {
 protected:
  explicit LoopOnBlock(const char* tool = "drill-3.2", const Vec3& start = {0, 0, -1}) : field_(bone_, BodyId{}) {
    ToolModel model(*find_tool(tool), bone_.pitch_mm());
    LoopParams params;
    params.ramp_s = 1e-9;  // the ramp after connecting has its own test
    loop_ = std::make_unique<HapticLoop>(params, std::vector<ToolModel>{model});
    loop_->take_up(0, {start, Eigen::Quaterniond::Identity()}, WorkspaceMapping{});
    input_.pose_device_tool.position_mm = start;
    builder_.build(field_, loop_->tool(0), {start, Eigen::Quaterniond::Identity()}, patch_);
  }
  LoopReport tick() { return loop_->tick(input_, patch_); }
  // Moves the handle in small steps.
  LoopReport move_to(const Vec3& to, int ticks = 100) {
    const Vec3 from = input_.pose_device_tool.position_mm;
    LoopReport report;
    for (int i = 1; i <= ticks; ++i) {
      input_.pose_device_tool.position_mm = from + (to - from) * i / ticks;
      report = tick();
    }
    return report;
  }
  // A loop whose force comes and goes within 0.2 s, pressed on the surface after the ramp. Returns the force.
  double press_with_ramp() {
    LoopParams params;
    params.ramp_s = 0.2;
    loop_ = std::make_unique<HapticLoop>(params, std::vector<ToolModel>{loop_->tool(0)});
    loop_->take_up(0, {{0, 0, -1}, Eigen::Quaterniond::Identity()}, WorkspaceMapping{});
    for (int i = 0; i < 300; ++i) tick();
    move_to({0, 0, 0.3});
    return tick().force_device_n.norm();
  }

  Case bone_ = block_case();
  CutField field_;
  std::unique_ptr<HapticLoop> loop_;
  PatchBuilder builder_;
  Patch patch_;
  LoopInput input_;
};

TEST_F(LoopOnBlock, FreeAirHasNoForce) {
  const LoopReport report = move_to({0, 0, -0.2});
  EXPECT_EQ(report.force_device_n.norm(), 0.0);
  EXPECT_NEAR(report.pose_bone_proxy.position_mm.z(), -0.2, 1e-9);
  EXPECT_EQ(report.phase, CuttingPhase::idle);
}

// A tool was held far from bone while its hand went on, as by a stopped room. At the hand's target nothing is known of
// the bone, and patches built round the tool never reach there. The tool goes as far as is known, patch by patch.
TEST_F(LoopOnBlock, AToolFarBehindItsHandInTheAirComesUp) {
  for (const double height_mm : {-5.0, -20.0, -45.0}) {
    const Vec3 tool_mm(-40, 3, height_mm), hand_mm(30, -10, height_mm);
    loop_->take_up(0, {tool_mm, Eigen::Quaterniond::Identity()}, WorkspaceMapping{});
    input_.pose_device_tool.position_mm = hand_mm;
    Vec3 at_mm = tool_mm;
    for (int i = 0; i < 400; ++i) {
      if (i % 10 == 0) builder_.build(field_, loop_->tool(0), {at_mm, Eigen::Quaterniond::Identity()}, patch_);
      const LoopReport report = tick();
      EXPECT_EQ(report.force_device_n.norm(), 0.0);
      at_mm = report.pose_bone_proxy.position_mm;
    }
    EXPECT_LT((at_mm - hand_mm).norm(), 1e-6) << height_mm;
  }
}

// Spindle off: the tip stays on the surface and the coupling's spring pushes back, K_c times the penetration.
TEST_F(LoopOnBlock, ASpringWallWhereNothingTurns) {
  LoopReport report = move_to({0, 0, 0.3});
  for (int i = 0; i < 20; ++i) report = tick();
  EXPECT_NEAR(report.pose_bone_proxy.position_mm.z(), 0.0, 0.125);  // a pitch of the tool's cuts
  const double extension = 0.3 - report.pose_bone_proxy.position_mm.z();
  EXPECT_NEAR(-report.force_physical_n.z(), 50.0 * extension, 1e-3);
  EXPECT_NEAR(report.force_device_n.z(), report.force_physical_n.z(), 1e-3);  // s = 1, nothing moves
  EXPECT_EQ(report.phase, CuttingPhase::rubbing);
  EXPECT_EQ(loop_->cuts_closed(), 0u);
}

TEST_F(LoopOnBlock, ForceIsClampedToTheDevice) {
  LoopReport report = move_to({0, 0, 5.0}, 400);
  EXPECT_NEAR(report.force_device_n.norm(), 60.0, 1e-9);
  EXPECT_TRUE(report.events & kForceLimited);
  input_.device_warm = true;
  report = tick();
  EXPECT_NEAR(report.force_device_n.norm(), 30.0, 1e-9);
}

TEST_F(LoopOnBlock, TheClutchIsForcelessAndMovesNothing) {
  move_to({0, 0, 0.3});
  const Vec3 held = tick().pose_bone_proxy.position_mm;
  input_.clutch = true;
  for (int i = 0; i < 50; ++i) {
    input_.pose_device_tool.position_mm += Vec3(0.5, -0.3, 0.4);
    const LoopReport report = tick();
    EXPECT_EQ(report.force_device_n.norm(), 0.0);
    EXPECT_EQ(report.pose_bone_proxy.position_mm, held);
  }
  // When the clutch is released elsewhere in the workspace, motion goes on from where the tool is, without a jump in
  // force.
  input_.clutch = false;
  const LoopReport report = tick();
  EXPECT_NEAR((report.pose_bone_proxy.position_mm - held).norm(), 0.0, 1e-6);
  EXPECT_NEAR(report.force_device_n.norm(), 0.0, 1e-4);
}

TEST_F(LoopOnBlock, SafetyZerosComeAtOnce) {
  for (int fault = 0; fault < 3; ++fault) {
    loop_->take_up(0, {{0, 0, -1}, Eigen::Quaterniond::Identity()}, WorkspaceMapping{});
    input_ = {};
    input_.pose_device_tool.position_mm = {0, 0, -1};
    move_to({0, 0, 0.3});
    ASSERT_GT(tick().force_device_n.norm(), 8.0);
    if (fault == 0) input_.device_ok = false;
    if (fault == 1) input_.periods = 4;
    Patch nothing;
    const LoopReport report = fault == 2 ? loop_->tick(input_, nothing) : tick();
    EXPECT_EQ(report.force_device_n.norm(), 0.0) << fault;
  }
}

// A device that comes back has its handle elsewhere. The tool stays where it was, the hand feels nothing of the
// difference, and force rises over the ramp.
TEST_F(LoopOnBlock, ADeviceThatComesBackIsTakenUpWithoutForce) {
  ASSERT_GT(press_with_ramp(), 8.0);
  input_.device_ok = false;
  const double held_mm = tick().pose_bone_proxy.position_mm.z();
  input_.pose_device_tool.position_mm.z() = 20.0;  // pushed while nothing held it
  input_.device_ok = true;
  LoopReport report = tick();
  EXPECT_EQ(report.force_device_n.norm(), 0.0);
  EXPECT_NEAR(report.pose_bone_proxy.position_mm.z(), held_mm, 1e-6);
  EXPECT_TRUE(report.events & kRamping);
  for (int i = 1; i <= 300; ++i) {
    input_.pose_device_tool.position_mm.z() = 20.0 + 1e-3 * i;
    report = tick();
    // Spring and damping, of 2 ms, of what was pressed since, times the ramp's share.
    EXPECT_LE(report.force_device_n.norm(), 50.0 * (1e-3 * i + 2e-3) * std::min(1.0, (i + 1) / 200.0) + 1e-9) << i;
  }
  EXPECT_FALSE(report.events & kRamping);
  // While less force was shown, the hand's advance was not paid for. That stretch was let go.
  const double ramped_n = report.force_device_n.norm();
  EXPECT_GT(ramped_n, 5.0);
  EXPECT_LT(ramped_n, 50.0 * 0.301);
  for (int i = 1; i <= 100; ++i) {
    input_.pose_device_tool.position_mm.z() = 20.3 + 1e-3 * i;
    report = tick();
  }
  EXPECT_NEAR(report.force_device_n.norm(), ramped_n + 50.0 * 0.1, 0.1);  // from then on the whole spring
}

// A force that the hand did not cause may only grow by 0.5 N a millisecond.
TEST_F(LoopOnBlock, ForceReturnsGradually) {
  move_to({0, 0, 0.5});
  const double full = tick().force_device_n.norm();
  ASSERT_GT(full, 15.0);
  input_.periods = 4;
  ASSERT_EQ(tick().force_device_n.norm(), 0.0);
  input_.periods = 1;
  double before = 0.0;
  for (int i = 0; i < 100; ++i) {
    const double now = tick().force_device_n.norm();
    EXPECT_LE(now, before + 0.5 + 1e-9);
    before = now;
  }
  EXPECT_NEAR(before, full, 0.01);
}

TEST_F(LoopOnBlock, WhileTheRoomIsSilentTheSpindleRunsDownAndBoneStaysHard) {
  input_.spindle_rpm = 1000;
  for (int i = 0; i < 400; ++i) tick();
  EXPECT_EQ(tick().spindle_rpm, 1000.0);
  input_.room = RoomLink::held;
  for (int i = 0; i < 400; ++i) tick();
  move_to({0, 0, 0.3});
  for (int i = 0; i < 2000; ++i) {
    const LoopReport report = tick();
    ASSERT_EQ(report.spindle_rpm, 0.0);
    ASSERT_NE(report.phase, CuttingPhase::cutting);
    ASSERT_TRUE(report.events & kRoomHeld);
    // The spring of the hand's depth in the bone. Its contact point is slightly before it.
    ASSERT_NEAR(report.force_device_n.norm(), 50.0 * 0.3, 50.0 * 0.1) << i;
  }
}

// When the device is lost for good, the force on the hand falls over the ramp, not at once.
TEST_F(LoopOnBlock, AtTheEndTheHandIsLetGoOverTheRamp) {
  const double full_n = press_with_ramp();
  ASSERT_GT(full_n, 8.0);
  input_.room = RoomLink::over;
  for (int i = 1; i <= 200; ++i) {
    const LoopReport report = tick();
    EXPECT_LE(report.force_device_n.norm(), full_n * (1.0 - i / 200.0) + 1e-9) << i;
    EXPECT_TRUE(report.events & kRamping);
    if (i == 100) {
      EXPECT_GT(report.force_device_n.norm(), 0.2 * full_n);
    }
  }
  EXPECT_EQ(tick().force_device_n.norm(), 0.0);
}

// k of the device is never exceeded, however far the tool moves for each millimetre of the handle.
TEST_F(LoopOnBlock, TheDeviceFeelsNoMoreThanItsStiffness) {
  for (const double scale : {0.5, 1.0, 4.0}) {
    WorkspaceMapping mapping;
    mapping.align(Eigen::Quaterniond::Identity(), scale, {0, 0, -1}, {0, 0, -1});
    loop_->take_up(0, {{0, 0, -1}, Eigen::Quaterniond::Identity()}, mapping);
    input_.pose_device_tool.position_mm = {0, 0, -1};
    const auto force_at = [&](double bone_mm) {
      move_to({0, 0, -1.0 + (bone_mm + 1.0) / scale});
      tick();
      return tick().force_device_n.norm();
    };
    const double low_n = force_at(0.3), shown = (force_at(0.5) - low_n) / (0.2 / scale);
    EXPECT_NEAR(shown, std::min(50.0 * scale, 60.0), 0.02 * 60.0) << scale;
  }
}

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
  ASSERT_GT(bench.tick().report.force_device_n.norm(), 5.0);
  EXPECT_GT(bench.session().tick(bench.patch(), RoomLink::follows, 3).report.force_device_n.norm(), 5.0);
  const LoopReport late = bench.session().tick(bench.patch(), RoomLink::follows, 4).report;
  EXPECT_EQ(late.force_device_n.norm(), 0.0);
  EXPECT_TRUE(late.events & kMissedTicks);
}

// Cuts and contact are no finer than the case allows.
TEST(ToolModel, CutsNoFinerThanTheCase) {
  const Tool tool = *find_tool("drill-3.2");
  for (const double h : {0.5, 0.25, 0.15, 0.08}) {
    const ToolModel model(tool, h);
    EXPECT_EQ(model.cut_level, std::min(tool.cut_level, finest_level(h))) << h;
    EXPECT_EQ(model.fine_pitch_mm, level_pitch_mm(h, model.cut_level)) << h;
    EXPECT_EQ(cut_of(CutPiece{}, model, AuthorId{1}, 7).level, model.cut_level) << h;
  }
  EXPECT_LT(ToolModel(tool, 0.15).cut_level, tool.cut_level);
}

// If the room does not answer, little bone may be gone that only this client has removed.
TEST(ConfirmationMonitor, HoldsTheSpindleWhileTheRoomDoesNotFollow) {
  ConfirmationMonitor watch;
  EXPECT_EQ(watch.update(100.0, false, 0), RoomHealth::follows);
  EXPECT_EQ(watch.update(200.0, false, 0), RoomHealth::follows);  // nobody cuts, so no answer is needed
  EXPECT_EQ(watch.update(201.9, false, 1), RoomHealth::follows);
  EXPECT_EQ(watch.update(202.1, false, 1), RoomHealth::silent);
  EXPECT_EQ(watch.update(202.2, true, 1), RoomHealth::follows);
  EXPECT_EQ(watch.update(223.0, false, 1), RoomHealth::lost);

  EXPECT_EQ(watch.update(300.0, true, 512), RoomHealth::follows);
  EXPECT_EQ(watch.update(300.1, true, 513), RoomHealth::behind);
  EXPECT_EQ(watch.update(300.2, true, 300), RoomHealth::behind);  // no switching on and off at the limit
  EXPECT_EQ(watch.update(300.3, true, 256), RoomHealth::follows);
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
      force_on_the_way_out = std::max(force_on_the_way_out, tick.report.force_physical_n.norm());
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
  EXPECT_LT(report.force_physical_n.x(), -5.0);
  input.pose_device_tool.position_mm = {0, 0, 6};
  for (int i = 0; i < 100; ++i) {
    input.pose_device_tool.position_mm.z() = 6 + 0.03 * i;
    report = loop.tick(input, patch);
  }
  EXPECT_NEAR(report.pose_bone_proxy.position_mm.z(), 8.97, 0.1);
  EXPECT_EQ(report.force_physical_n.norm(), 0.0);
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
    lead(Vec3(x_mm_, 0, tip_mm().z() + ahead_mm_) - (ticks_ ? report_.offset_mm : Vec3(Vec3::Zero())));
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
  EXPECT_NEAR(hand.report_.force_physical_n.z(), -29.0, 0.1);
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
  EXPECT_LT(hand.report_.force_physical_n.x(), -15.0);
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
    force_max = std::max(force_max, tick.report.force_physical_n.norm());
    work_min = std::min(work_min, tick.report.cutting_force_n.dot(tick.report.moved_mm));
    cutting |= tick.report.phase == CuttingPhase::cutting;
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

TEST(Replica, ARejectedCutComesBack) {
  const Case bone = block_case();
  Replica replica(bone, BodyId{});
  const Tool tool = *find_tool("drill-3.2");
  const auto cut_at = [&](std::uint64_t seq, double x) {
    Cut cut;
    cut.author = AuthorId{1};
    cut.author_seq = seq;
    cut.tool = tool.hash();
    cut.level = tool.cut_level;
    cut.path = {quantise(pose_along({x, 0, 0}, Vec3::UnitZ())), quantise(pose_along({x, 0, 3}, Vec3::UnitZ()))};
    return cut;
  };
  replica.add_own(cut_at(1, -3));
  replica.add_own(cut_at(2, 3));
  EXPECT_GT(replica.predicted().solid_mm({3, 0, 1}), 0.0);
  EXPECT_LT(replica.committed().solid_mm({3, 0, 1}), 0.0);
  (void)replica.take_changes();
  replica.commit(RoomSeq{1}, cut_at(1, -3), true);
  replica.reject(RoomSeq{2}, 2);
  replica.settle();
  EXPECT_LT(replica.predicted().solid_mm({3, 0, 1}), 0.0);
  EXPECT_GT(replica.predicted().solid_mm({-3, 0, 1}), 0.0);
  EXPECT_FALSE(replica.take_changes().empty());
  EXPECT_EQ(replica.unconfirmed(), 0u);
  EXPECT_EQ(replica.predicted().hash(), replica.committed().hash());
}

// After a lost connection, a cut may be sent and answered twice. The second answer may come after the cut was undone.
TEST(Replica, AnAnswerThatComesAgainBringsNothingBack) {
  const Case bone = block_case();
  const Tool tool = *find_tool("drill-3.2");
  Cut cut;
  cut.author = AuthorId{1};
  cut.author_seq = 1;
  cut.tool = tool.hash();
  cut.level = tool.cut_level;
  cut.path = {quantise(pose_along({0, 0, 0}, Vec3::UnitZ())), quantise(pose_along({0, 0, 3}, Vec3::UnitZ()))};
  CutField field(bone, BodyId{});
  const Digest uncut = field.hash();
  std::vector<FieldLeaf> before;
  for (const Coord origin : field.apply(cut).changed_leaves) before.push_back({BodyId{}, cut.level, origin, {}});
  for (FieldLeaf& leaf : before) CutField(bone, BodyId{}).read(leaf);
  Replica replica(bone, BodyId{});
  replica.add_own(cut);
  replica.commit(RoomSeq{1}, cut, true);
  EXPECT_EQ(replica.hash(), field.hash());
  const BodyId bodies[] = {BodyId{}};
  replica.change(RoomSeq{2}, bodies, before);
  replica.settle();
  EXPECT_EQ(replica.hash(), uncut);
  replica.commit(RoomSeq{1}, cut, true);
  replica.settle();
  EXPECT_EQ(replica.hash(), uncut);
  EXPECT_EQ(replica.committed().hash(), uncut);
  EXPECT_EQ(replica.room_seq(), RoomSeq{2});
}

// Several rejections in sequence, among own and other cuts through the same bone. The result is the committed field
// with the pending cuts. The pending cuts are applied again once, the committed ones not at all.
TEST(Replica, RejectionsInARowAreSettledOnce) {
  const Case bone = block_case();
  const Tool tool = *find_tool("drill-3.2");
  const auto cut_at = [&](std::uint64_t author, std::uint64_t seq, double x) {
    Cut cut;
    cut.author = AuthorId{author};
    cut.author_seq = seq;
    cut.tool = tool.hash();
    cut.level = tool.cut_level;
    cut.path = {quantise(pose_along({x, 0, 0}, Vec3::UnitZ())), quantise(pose_along({x, 0, 3}, Vec3::UnitZ()))};
    return cut;
  };
  Replica replica(bone, BodyId{});
  CutField expected(bone, BodyId{});
  std::uint64_t place = 0;
  for (int i = 0; i < 20; ++i) {
    replica.commit(RoomSeq{++place}, cut_at(2, 1 + i, -4.0 + 0.1 * i), false);
    expected.apply(cut_at(2, 1 + i, -4.0 + 0.1 * i));
  }
  // 1 to 6 overlap. What 5 would take is already gone by 2, which is rejected.
  const double x[] = {-2.5, 0.0, 0.6, 2.5, 0.1, 3.5};
  for (std::uint64_t seq = 1; seq <= 6; ++seq) replica.add_own(cut_at(1, seq, x[seq - 1]));
  (void)replica.take_changes();
  replica.reject(RoomSeq{++place}, 2);
  replica.reject(RoomSeq{++place}, 3);
  replica.commit(RoomSeq{++place}, cut_at(2, 21, 4.0), false);
  expected.apply(cut_at(2, 21, 4.0));
  replica.reject(RoomSeq{++place}, 4);
  replica.settle();
  EXPECT_EQ(replica.committed().hash(), expected.hash());
  for (const std::uint64_t seq : {1, 5, 6}) expected.apply(cut_at(1, seq, x[seq - 1]));
  EXPECT_EQ(replica.predicted().hash(), expected.hash());
  EXPECT_EQ(replica.cut_again(), 3u);
  // A cut that removed again what a rejected one had removed may be rejected later.
  replica.reject(RoomSeq{++place}, 5);
  replica.settle();
  replica.commit(RoomSeq{++place}, cut_at(1, 1, x[0]), true);
  replica.commit(RoomSeq{++place}, cut_at(1, 6, x[5]), true);
  EXPECT_EQ(replica.unconfirmed(), 0u);
  EXPECT_EQ(replica.predicted().hash(), replica.committed().hash());
}

TEST(WorkspaceMapping, ReachesFarWithTheClutch) {
  WorkspaceMapping mapping;
  const Eigen::Quaterniond view(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()));
  mapping.align(view, 2.0, {5, 0, 0}, {100, 50, 20});
  const Pose handle{{10, 3, -4}, Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vec3::UnitY()))};
  const Pose tool = mapping.pose_bone_tool(handle);
  // Round trip, scale and directions.
  EXPECT_NEAR((mapping.pose_device_tool(tool).position_mm - handle.position_mm).norm(), 0.0, 1e-12);
  EXPECT_NEAR((tool.position_mm - Vec3(100, 50, 20)).norm(), 2.0 * (handle.position_mm - Vec3(5, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR((mapping.to_bone(mapping.to_device(Vec3(1, 2, 3))) - Vec3(1, 2, 3)).norm(), 0.0, 1e-12);
  // Re-anchoring keeps the tool where it is.
  mapping.anchor({0, 0, 0}, tool.position_mm);
  EXPECT_NEAR((mapping.pose_bone_tool({Vec3::Zero(), handle.rotation}).position_mm - tool.position_mm).norm(), 0.0,
              1e-12);
}

TEST(CutRecorder, KeepsACornerAndDropsWhatIsStraight) {
  CutRecorder recorder;
  recorder.begin({}, 5.0);
  for (int i = 1; i <= 4; ++i) recorder.add({{0.05 * i, 0, 0}, Eigen::Quaterniond::Identity()});
  for (int i = 1; i <= 4; ++i) recorder.add({{0.2, 0.05 * i, 0}, Eigen::Quaterniond::Identity()});
  EXPECT_TRUE(recorder.due());
  CutPiece piece;
  ASSERT_TRUE(recorder.close(piece));
  ASSERT_EQ(piece.knots, 3);
  EXPECT_EQ(piece.path[1], quantise({{0.2, 0, 0}, Eigen::Quaterniond::Identity()}));
  EXPECT_EQ(piece.path[2], quantise({{0.2, 0.2, 0}, Eigen::Quaterniond::Identity()}));
  // Standing still closes nothing.
  recorder.add({{0.2, 0.2, 0}, Eigen::Quaterniond::Identity()});
  EXPECT_FALSE(recorder.close(piece));
}

}  // namespace
}  // namespace osteon::haptic::test
