// Drilling through a guide compared with drilling by eye, with a hand that trembles, on virtual time.
#include "haptic_client/contact/guiding.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/allocation_counter.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

constexpr double kBore_mm = 3.5, kLength_mm = 30.0, kPlay_mm = 0.5 * (kBore_mm - 3.2);

Tool sleeve() {
  Tool tool;
  tool.name = "test-sleeve";
  tool.title = "Sleeve";
  tool.kind = ToolKind::drill_sleeve;
  tool.diameter_mm = 8.0;
  tool.bore_mm = kBore_mm;
  tool.cutting_length_mm = kLength_mm;
  return tool;
}

Result<Tool> find(std::string_view name) { return name == "test-sleeve" ? Result<Tool>(sleeve()) : find_tool(name); }

PlanStep place_step() {
  PlanStep step;
  step.action = Action::place;
  step.tool = "test-sleeve";
  step.seconds = 0.1;
  step.entry.point_mm = Vec3(0.3, -0.2, 0);
  step.entry.axis = Vec3(0, 0, 1);
  return step;
}

PlanStep shaky_drill(bool guided, HandKind hand) {
  PlanStep step;
  step.action = Action::drill;
  step.tool = "drill-3.2";
  step.hand = hand;
  step.spindle_rpm = 1000;
  step.feed_mm_per_s = 2;
  step.beyond_mm = 3;
  step.tremor_mm = 1.2;
  step.through_guide = guided;
  if (!guided) step.entry = place_step().entry;
  return step;
}

// How far the cut tips lie from the planned line, where the guide stands or would stand.
struct Hole {
  double worst_mm = 0, worst_excess_mm = -1, at_entry_mm = 0, tilt_rad = 0;
  int knots = 0;
  bool completed = false, guided = false;
};

Hole drill_hole(bool guided, HandKind hand) {
  std::vector<PlanStep> plan{shaky_drill(guided, hand)};
  if (guided) plan.insert(plan.begin(), place_step());
  const Case bone = block_case();
  const Result<ReadyPlan> ready = make_ready(plan, bone, find);
  EXPECT_TRUE(ready.has_value());
  Bench bench(bone, *ready);
  Hole hole;
  bench.run([&](const SessionTick& tick) { hole.guided |= (tick.report.events & kGuided) != 0; });
  hole.completed =
      bench.session().done() && std::ranges::all_of(bench.session().surgeon().results(), &StepResult::completed);
  const Vec3 line(0.3, -0.2, 0);
  for (const Cut& cut : bench.cuts())
    for (const QuantisedPose& knot : cut.path) {
      const Pose pose = dequantise(knot);
      if (pose.position_mm.z() < 0.5 || pose.position_mm.z() > 30.0) continue;
      const double off = (pose.position_mm - line).head<2>().norm();
      const double bound = kPlay_mm * (1.0 + 2.0 * pose.position_mm.z() / kLength_mm);
      if (hole.knots++ == 0) hole.at_entry_mm = off;
      hole.worst_mm = std::max(hole.worst_mm, off);
      hole.worst_excess_mm = std::max(hole.worst_excess_mm, off - bound);
      hole.tilt_rad = std::max(hole.tilt_rad, std::acos(std::clamp(pose.direction(Vec3::UnitZ()).z(), -1.0, 1.0)));
    }
  std::printf("  %s, %s: off the line at the entry %.3f mm, at most %.3f mm, tilt at most %.2f degrees\n",
              guided ? "guided" : "by eye",
              hand == HandKind::rig      ? "rig"
              : hand == HandKind::expert ? "expert"
                                         : "novice",
              hole.at_entry_mm, hole.worst_mm, hole.tilt_rad * 180.0 / std::numbers::pi);
  return hole;
}

// The sleeve's play bounds the hole: c (1 + 2 l / L) at depth l. Poses of cuts are quantised and the proxy follows the
// hand by a tick, so a hundredth of a millimetre is allowed.
TEST(GuidedDrilling, StaysWithinTheSleevesPlay) {
  for (const HandKind hand : {HandKind::rig, HandKind::expert}) {
    const Hole guided = drill_hole(true, hand), free = drill_hole(false, hand);
    EXPECT_TRUE(guided.completed);
    EXPECT_TRUE(free.completed);
    EXPECT_TRUE(guided.guided);
    EXPECT_FALSE(free.guided);
    EXPECT_GT(guided.knots, 500);
    EXPECT_LE(guided.worst_excess_mm, 0.01);
    // Two points within the play, a sleeve's length apart. The hand is kept to that. The drill is also held by its own
    // hole and may lean a little more, by less than 0.03 mm at either end of the sleeve.
    EXPECT_LE(guided.tilt_rad, 2.0 * kPlay_mm / kLength_mm + 2e-3);
    EXPECT_GT(free.worst_mm, kPlay_mm * (1.0 + 2.0));
    EXPECT_GT(free.worst_excess_mm, 0.1);
  }
}

// The hand feels the sleeve as a sideways spring of the coupling, beyond the play.
TEST(GuidedDrilling, TheSleevePushesBackSideways) {
  const PlacedGuide guide = placed_guide(1, sleeve(), {Vec3(0, 0, 0), Eigen::Quaterniond::Identity()});
  const Case bone = block_case();
  const CutField field(bone, BodyId{});
  HapticLoop loop(LoopParams{.ramp_s = 1e-9}, {ToolModel(*find_tool("drill-3.2"), bone.pitch_mm())});
  Patch patch;
  PatchBuilder builder;
  const Pose start{{0, 0, -5}, Eigen::Quaterniond::Identity()};  // 25 mm in the sleeve, over the bone
  builder.build(field, loop.tool(0), start, patch);
  loop.take_up(0, start, WorkspaceMapping{});
  LoopInput input;
  input.pose_device_tool = start;
  LoopReport report;
  std::int64_t allocations = 0;
  for (int i = 1; i <= 200; ++i) {
    input.pose_device_tool.position_mm.x() = 0.002 * i;
    const osteon::test::AllocationCounter heap;
    report = loop.tick(input, patch, std::span(&guide, 1));
    allocations += heap.count();
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_TRUE(report.events & kGuided);
  EXPECT_NEAR(report.pose_bone_proxy.position_mm.x(), kPlay_mm, 1e-6);
  EXPECT_NEAR(report.coupling.force_n.x(), -50.0 * (0.4 - kPlay_mm), 1e-6);
  EXPECT_NEAR(report.coupling.force_n.z(), 0.0, 1e-9);
  // Within the play, or without the guide, it feels nothing.
  for (int i = 0; i < 200; ++i) {
    input.pose_device_tool.position_mm.x() = std::max(0.1, 0.4 - 0.002 * i);
    report = loop.tick(input, patch, std::span(&guide, 1));
  }
  EXPECT_EQ(report.coupling.force_n.norm(), 0.0);
  input.pose_device_tool.position_mm.x() = 0.4;
  for (int i = 0; i < 5; ++i) report = loop.tick(input, patch);
  EXPECT_EQ(report.coupling.force_n.norm(), 0.0);
  EXPECT_FALSE(report.events & kGuided);
}

// A drill near a sleeve that stands on the bone, its top at z = -30. The hand moves it from point to point. The device
// is so strong that its slack does not keep the hand from reaching through the wall.
class AtASleeve : public ::testing::Test {
 protected:
  AtASleeve()
      : bone_(block_case()),
        field_(bone_, BodyId{}),
        loop_(LoopParams{.peak_n = 400.0, .ramp_s = 1e-9}, {ToolModel(*find_tool("drill-3.2"), 0.5)}) {}
  void take_up(const Vec3& tip_mm) {
    input_.pose_device_tool = {tip_mm, Eigen::Quaterniond::Identity()};
    builder_.build(field_, loop_.tool(0), input_.pose_device_tool, patch_);
    loop_.take_up(0, input_.pose_device_tool, WorkspaceMapping{});
  }
  void lead(const Vec3& to_mm, double mm_per_s) {
    Vec3& hand_mm = input_.pose_device_tool.position_mm;
    const double step_mm = 1e-3 * mm_per_s;
    while ((to_mm - hand_mm).norm() > 1e-9) {
      const Vec3 way = to_mm - hand_mm;
      hand_mm += way.norm() > step_mm ? Vec3(way * (step_mm / way.norm())) : way;
      builder_.build(field_, loop_.tool(0), input_.pose_device_tool, patch_);
      const LoopReport now = loop_.tick(input_, patch_, std::span(&guide_, 1));
      // What the hand's own step and the slew limit allow. Nothing may grow faster.
      const double grown_n = now.device.force_n.norm() - report_.device.force_n.norm();
      worst_n_ = std::max(worst_n_, grown_n - 2.0 * loop_.coupling_n_per_mm() * step_mm);
      fastest_mm_ = std::max(fastest_mm_, now.contact.moved_mm.norm() - step_mm);
      guided_ |= (now.events & kGuided) != 0;
      report_ = now;
    }
  }
  [[nodiscard]] const Vec3& tip_mm() const { return report_.pose_bone_proxy.position_mm; }

  const PlacedGuide guide_ = placed_guide(1, sleeve(), {Vec3(0, 0, 0), Eigen::Quaterniond::Identity()});
  Case bone_;
  CutField field_;
  HapticLoop loop_;
  PatchBuilder builder_;
  Patch patch_;
  LoopInput input_;
  LoopReport report_;
  double worst_n_ = 0, fastest_mm_ = 0;
  bool guided_ = false;
};

// Pressed against the sleeve from outside, as far as its middle and beyond, the drill stays outside. It does not jump
// into the bore.
TEST_F(AtASleeve, IsNotPulledInThroughItsWall) {
  take_up({-12, 0, -15});
  lead({-6.5, 0, -15}, 20.0);
  EXPECT_EQ(report_.coupling.force_n.norm(), 0.0);
  lead({0, 0, -15}, 20.0);
  EXPECT_NEAR(tip_mm().x(), -4.0 - 1.6, 0.3);  // radius of the sleeve and of the drill
  EXPECT_NEAR(report_.coupling.force_n.x(), 50.0 * tip_mm().x(), 1e-6);
  lead({1, 0, -15}, 20.0);
  EXPECT_LT(tip_mm().x(), -5.0);
  EXPECT_FALSE(guided_);
  lead({-12, 0, -15}, 20.0);
  EXPECT_EQ(report_.coupling.force_n.norm(), 0.0);
  EXPECT_LE(worst_n_, LoopParams{}.slew_n_per_ms + 1e-6);
  EXPECT_LT(fastest_mm_, 0.1);
}

// Pressed on the rim of the sleeve's mouth and moved over it, the drill enters at the mouth and no sooner. The force
// with which it was pressed is then gone.
TEST_F(AtASleeve, IsEnteredFromItsRimThroughTheMouth) {
  take_up({2.8, 0, -33});
  lead({2.8, 0, -29.6}, 10.0);
  EXPECT_NEAR(tip_mm().z(), -30.0, 0.3);
  EXPECT_LT(report_.coupling.force_n.z(), -10.0);
  EXPECT_FALSE(guided_);
  lead({0, 0, -29.6}, 5.0);
  EXPECT_TRUE(guided_);
  lead({0, 0, -20}, 20.0);
  EXPECT_NEAR((tip_mm() - Vec3(0, 0, -20)).norm(), 0.0, kPlay_mm);
  EXPECT_LT(report_.coupling.force_n.norm(), 1e-6);
  EXPECT_LE(worst_n_, LoopParams{}.slew_n_per_ms + 1e-6);
}

TEST(GuidedPlan, NamesWhatIsWrong) {
  const Case bone = block_case();
  const auto message = [&](const std::vector<PlanStep>& plan) { return make_ready(plan, bone, find).error().message; };
  PlanStep drill = shaky_drill(true, HandKind::rig);
  EXPECT_NE(message({drill}).find("places a guide"), std::string::npos);
  PlanStep place = place_step();
  place.tool = "drill-3.2";
  EXPECT_NE(message({place}).find("not a guide"), std::string::npos);
  drill.to_mm = 100.0;
  EXPECT_NE(message({place_step(), drill}).find("to_mm"), std::string::npos);
}

}  // namespace
}  // namespace osteon::haptic::test
