// Tests that the thickness of a cortical layer is found from inside, and none elsewhere.
#include "haptic_client/contact/cortex_probe.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "haptic_client/contact/patch_builder.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::haptic::test {
namespace {

constexpr double kLayerPitch_mm = 0.5;
// A face between two samples is known to a pitch, and each end of a layer is one.
constexpr double kEnd_mm = 0.5 * kLayerPitch_mm;

// Near cortex 5 mm, medulla 12 mm, far cortex 3 mm, from z = 0 down.
Case sandwich() { return osteon::test::layered_block({{5.0, 1.9}, {12.0, 0.3}, {3.0, 1.9}}, 40.0, kLayerPitch_mm); }

// What is found with the tool at a tip, after it has cut its way there from `above_mm` along its axis.
double found_mm(const std::string& name, const Vec3& tip_mm, const Vec3& axis, const Vec3& on_bone_n = Vec3::Zero(),
                double above_mm = 12.0) {
  const Case bone = sandwich();
  const ToolModel model(*find_tool(name), bone.pitch_mm());
  CutField field(bone, BodyId{});
  field.apply(osteon::test::straight_cut(model.tool, tip_mm - above_mm * axis, tip_mm, axis));
  Patch patch;
  const Pose pose = pose_along(tip_mm, axis);
  PatchBuilder().build(field, model, pose, patch);
  CortexProbe probe;
  const osteon::test::AllocationCounter heap;
  for (int i = 0; i < 4; ++i) probe.step(model, patch, pose, true, on_bone_n);
  EXPECT_EQ(heap.count(), 0);
  const double found = probe.thickness_mm();
  probe.step(model, patch, pose, false, on_bone_n);
  EXPECT_EQ(probe.thickness_mm(), 0.0) << "in the air";
  return found;
}
double drilled_mm(double depth_mm) { return found_mm("drill-3.2", {0, 0, -depth_mm}, -Vec3::UnitZ()); }

// The whole layer, wherever in it the tip is: the hole behind the tip counts as the bone that it was.
TEST(CortexProbe, FindsTheLayerThatADrillCuts) {
  for (const double depth : {1.5, 3.0, 4.5}) EXPECT_NEAR(drilled_mm(depth), 5.0, 2.0 * kEnd_mm) << depth;
  for (const double depth : {18.0, 19.5}) EXPECT_NEAR(drilled_mm(depth), 3.0, 2.0 * kEnd_mm) << depth;
}

TEST(CortexProbe, FindsNoneInTheMedullaOrBeyondTheBone) {
  for (const double depth : {8.0, 11.0, 15.0, 23.0}) EXPECT_EQ(drilled_mm(depth), 0.0) << depth;
}

// Along an oblique axis the way through the layer is longer.
TEST(CortexProbe, MeasuresAlongTheAxis) {
  const double angle = std::numbers::pi / 6.0;
  const Vec3 axis{std::sin(angle), 0.0, -std::cos(angle)};
  EXPECT_NEAR(found_mm("drill-3.2", 3.0 / std::cos(angle) * axis, axis), 5.0 / std::cos(angle),
              2.0 * kEnd_mm / std::cos(angle));
}

// A bur that is led across the face is pressed down into it, and a blade stands on its teeth.
TEST(CortexProbe, MeasuresAlongTheForceOfAToolThatIsFedInAnyDirection) {
  for (const Vec3& axis : {Vec3(-Vec3::UnitZ()), Vec3(Vec3(1, 0, -1).normalized())})
    EXPECT_NEAR(found_mm("burr-round-5", {0, 0, -1.5}, axis, {0, 0, -6.0}, 6.0), 5.0, 2.0 * kEnd_mm);
  EXPECT_NEAR(found_mm("saw-oscillating-1", {0, 0, -2.0}, -Vec3::UnitZ(), {0, 0, -6.0}, 6.0), 5.0, 2.0 * kEnd_mm);
}

// From the face, a patch shows as much as it reaches: a lower bound.
TEST(CortexProbe, SeesAtFirstNoMoreThanThePatchReaches) {
  const double found = drilled_mm(0.4);
  EXPECT_GT(found, 2.0);
  EXPECT_LE(found, 5.0 + 2.0 * kEnd_mm);
}

}  // namespace
}  // namespace osteon::haptic::test
