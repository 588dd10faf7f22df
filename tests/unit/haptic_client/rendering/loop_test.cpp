// The loop's duties towards the hand: clutch, limits, walls, lost connections.
#include "haptic_client/rendering/haptic_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/volume/cut_field.hpp"
#include "haptic_client/contact/patch_builder.hpp"
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
    return tick().device.force_n.norm();
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
  EXPECT_EQ(report.device.force_n.norm(), 0.0);
  EXPECT_NEAR(report.pose_bone_proxy.position_mm.z(), -0.2, 1e-9);
  EXPECT_EQ(report.cutting.phase, CuttingPhase::idle);
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
      EXPECT_EQ(report.device.force_n.norm(), 0.0);
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
  EXPECT_NEAR(-report.coupling.force_n.z(), 50.0 * extension, 1e-3);
  EXPECT_NEAR(report.device.force_n.z(), report.coupling.force_n.z(), 1e-3);  // s = 1, nothing moves
  EXPECT_EQ(report.cutting.phase, CuttingPhase::rubbing);
  EXPECT_EQ(loop_->cuts_closed(), 0u);
}

TEST_F(LoopOnBlock, ForceIsClampedToTheDevice) {
  LoopReport report = move_to({0, 0, 5.0}, 400);
  EXPECT_NEAR(report.device.force_n.norm(), 60.0, 1e-9);
  EXPECT_TRUE(report.events & kForceLimited);
  input_.device_warm = true;
  report = tick();
  EXPECT_NEAR(report.device.force_n.norm(), 30.0, 1e-9);
}

TEST_F(LoopOnBlock, TheClutchIsForcelessAndMovesNothing) {
  move_to({0, 0, 0.3});
  const Vec3 held = tick().pose_bone_proxy.position_mm;
  input_.clutch = true;
  for (int i = 0; i < 50; ++i) {
    input_.pose_device_tool.position_mm += Vec3(0.5, -0.3, 0.4);
    const LoopReport report = tick();
    EXPECT_EQ(report.device.force_n.norm(), 0.0);
    EXPECT_EQ(report.pose_bone_proxy.position_mm, held);
  }
  // When the clutch is released elsewhere in the workspace, motion goes on from where the tool is, without a jump in
  // force.
  input_.clutch = false;
  const LoopReport report = tick();
  EXPECT_NEAR((report.pose_bone_proxy.position_mm - held).norm(), 0.0, 1e-6);
  EXPECT_NEAR(report.device.force_n.norm(), 0.0, 1e-4);
}

TEST_F(LoopOnBlock, SafetyZerosComeAtOnce) {
  for (int fault = 0; fault < 3; ++fault) {
    loop_->take_up(0, {{0, 0, -1}, Eigen::Quaterniond::Identity()}, WorkspaceMapping{});
    input_ = {};
    input_.pose_device_tool.position_mm = {0, 0, -1};
    move_to({0, 0, 0.3});
    ASSERT_GT(tick().device.force_n.norm(), 8.0);
    if (fault == 0) input_.device_ok = false;
    if (fault == 1) input_.periods = 4;
    Patch nothing;
    const LoopReport report = fault == 2 ? loop_->tick(input_, nothing) : tick();
    EXPECT_EQ(report.device.force_n.norm(), 0.0) << fault;
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
  EXPECT_EQ(report.device.force_n.norm(), 0.0);
  EXPECT_NEAR(report.pose_bone_proxy.position_mm.z(), held_mm, 1e-6);
  EXPECT_TRUE(report.events & kRamping);
  for (int i = 1; i <= 300; ++i) {
    input_.pose_device_tool.position_mm.z() = 20.0 + 1e-3 * i;
    report = tick();
    // Spring and damping, of 2 ms, of what was pressed since, times the ramp's share.
    EXPECT_LE(report.device.force_n.norm(), 50.0 * (1e-3 * i + 2e-3) * std::min(1.0, (i + 1) / 200.0) + 1e-9) << i;
  }
  EXPECT_FALSE(report.events & kRamping);
  // While less force was shown, the hand's advance was not paid for. That stretch was let go.
  const double ramped_n = report.device.force_n.norm();
  EXPECT_GT(ramped_n, 5.0);
  EXPECT_LT(ramped_n, 50.0 * 0.301);
  for (int i = 1; i <= 100; ++i) {
    input_.pose_device_tool.position_mm.z() = 20.3 + 1e-3 * i;
    report = tick();
  }
  EXPECT_NEAR(report.device.force_n.norm(), ramped_n + 50.0 * 0.1, 0.1);  // from then on the whole spring
}

// A force that the hand did not cause may only grow by 0.5 N a millisecond.
TEST_F(LoopOnBlock, ForceReturnsGradually) {
  move_to({0, 0, 0.5});
  const double full = tick().device.force_n.norm();
  ASSERT_GT(full, 15.0);
  input_.periods = 4;
  ASSERT_EQ(tick().device.force_n.norm(), 0.0);
  input_.periods = 1;
  double before = 0.0;
  for (int i = 0; i < 100; ++i) {
    const double now = tick().device.force_n.norm();
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
    ASSERT_NE(report.cutting.phase, CuttingPhase::cutting);
    ASSERT_TRUE(report.events & kRoomHeld);
    // The spring of the hand's depth in the bone. Its contact point is slightly before it.
    ASSERT_NEAR(report.device.force_n.norm(), 50.0 * 0.3, 50.0 * 0.1) << i;
  }
}

// When the device is lost for good, the force on the hand falls over the ramp, not at once.
TEST_F(LoopOnBlock, AtTheEndTheHandIsLetGoOverTheRamp) {
  const double full_n = press_with_ramp();
  ASSERT_GT(full_n, 8.0);
  input_.room = RoomLink::over;
  for (int i = 1; i <= 200; ++i) {
    const LoopReport report = tick();
    EXPECT_LE(report.device.force_n.norm(), full_n * (1.0 - i / 200.0) + 1e-9) << i;
    EXPECT_TRUE(report.events & kRamping);
    if (i == 100) {
      EXPECT_GT(report.device.force_n.norm(), 0.2 * full_n);
    }
  }
  EXPECT_EQ(tick().device.force_n.norm(), 0.0);
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
      return tick().device.force_n.norm();
    };
    const double low_n = force_at(0.3), shown = (force_at(0.5) - low_n) / (0.2 / scale);
    EXPECT_NEAR(shown, std::min(50.0 * scale, 60.0), 0.02 * 60.0) << scale;
  }
}

}  // namespace
}  // namespace osteon::haptic::test
