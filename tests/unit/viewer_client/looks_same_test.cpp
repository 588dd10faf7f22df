#include "viewer_client/scene/looks_same.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace osteon {
namespace {

CuttingState at(const Vec3& position_mm, double angle_rad = 0) {
  CuttingState state;
  state.tool_name = "drill-3.2";
  state.pose_bone_tool.position_mm = position_mm;
  state.pose_bone_tool.rotation = Eigen::AngleAxisd(angle_rad, Vec3::UnitX());
  state.pose_bone_device = state.pose_bone_tool;
  return state;
}

TEST(LooksSame, AHandThatTremblesIsNotDrawnAgain) {
  EXPECT_TRUE(looks_same(at({1, 2, 3}), at({1, 2.004, 3})));
  EXPECT_FALSE(looks_same(at({1, 2, 3}), at({1, 2.006, 3})));
}

// The far end of a tool of 200 mm moves by 0.004 and by 0.006 mm.
TEST(LooksSame, ATurnCountsByTheMotionOfTheToolsFarEnd) {
  EXPECT_TRUE(looks_same(at({1, 2, 3}), at({1, 2, 3}, 0.00002)));
  EXPECT_FALSE(looks_same(at({1, 2, 3}), at({1, 2, 3}, 0.00003)));
}

TEST(LooksSame, WhateverAGaugeShowsCounts) {
  const CuttingState before = at({1, 2, 3});
  const auto differs = [&](auto change) {
    CuttingState after = before;
    change(after);
    return !looks_same(before, after);
  };
  EXPECT_FALSE(differs([](CuttingState&) {}));
  EXPECT_TRUE(differs([](CuttingState& s) { s.author = AuthorId{7}; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.tool_name = "drill-4.5"; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.phase = CuttingPhase::cutting; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.on_metal = true; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.irrigation = true; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.suction = true; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.flutes_full = 0.01; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.pose_bone_device.position_mm.z() += 0.01; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.spindle_rpm = 1; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.force_physical_N = {0, 0, 0.1}; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.force_hand_N = 0.1; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.device_holds_N = 3.3; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.depth_mm = 0.1; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.engaged_fraction = 0.01; }));
  EXPECT_TRUE(differs([](CuttingState& s) { s.density_g_cm3 = 0.01; }));
}

// Nothing that cannot be compared may freeze the picture.
TEST(LooksSame, AValueThatIsNoNumberIsDrawn) {
  EXPECT_FALSE(looks_same(at({1, 2, 3}), at({1, std::numeric_limits<double>::quiet_NaN(), 3})));
}

}  // namespace
}  // namespace osteon
