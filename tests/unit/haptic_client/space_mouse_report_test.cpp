// A SpaceMouse's reports, and rate control: a deflected cap is a velocity.
#include "haptic_client/device/space_mouse_report.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace osteon::haptic {
namespace {

using Report = std::vector<std::uint8_t>;

// 350 = 0x015e, −350 = 0xfea2, 175 = 0x00af.
const Report kRight{1, 0x5e, 0x01, 0, 0, 0, 0}, kTowardsUser{1, 0, 0, 0x5e, 0x01, 0, 0}, kDown{1, 0, 0, 0, 0, 0x5e, 0x01};

TEST(SpaceMouseReport, TheCapsAxesInTheDeviceFrame) {
  SpaceMouseState state;
  ASSERT_TRUE(take_report(state, kRight));
  EXPECT_EQ(state.push, Vec3(1, 0, 0));
  ASSERT_TRUE(take_report(state, kTowardsUser));
  EXPECT_EQ(state.push, Vec3(0, 0, 1));
  ASSERT_TRUE(take_report(state, kDown));
  EXPECT_EQ(state.push, Vec3(0, -1, 0));
  // The map keeps right hands right: x × y = z before and after.
  EXPECT_EQ(Vec3(1, 0, 0).cross(Vec3(0, 0, 1)), Vec3(0, -1, 0));
}

TEST(SpaceMouseReport, RotationInItsOwnReportOrBehindTheTranslation) {
  SpaceMouseState apart, together;
  ASSERT_TRUE(take_report(apart, Report{1, 0xaf, 0, 0xa2, 0xfe, 0, 0}));
  EXPECT_EQ(apart.twist, Vec3::Zero());
  ASSERT_TRUE(take_report(apart, Report{2, 0, 0, 0xaf, 0, 0x5e, 1}));
  ASSERT_TRUE(take_report(together, Report{1, 0xaf, 0, 0xa2, 0xfe, 0, 0, 0, 0, 0xaf, 0, 0x5e, 1}));
  EXPECT_EQ(apart.push, Vec3(0.5, 0, -1));
  EXPECT_EQ(apart.push, together.push);
  EXPECT_EQ(apart.twist, together.twist);
  EXPECT_EQ(together.twist, Vec3(0, -1, 0.5));
  // Longer still, as wireless ones pad it.
  ASSERT_TRUE(take_report(together, Report{1, 0, 0, 0, 0, 0, 0, 0x5e, 1, 0, 0, 0, 0, 9, 9, 9}));
  EXPECT_EQ(together.twist, Vec3(1, 0, 0));
}

TEST(SpaceMouseReport, ButtonsOfAnyWidthAndBattery) {
  SpaceMouseState state;
  ASSERT_TRUE(take_report(state, Report{3, 2}));
  EXPECT_EQ(state.buttons, 2u);
  ASSERT_TRUE(take_report(state, Report{3, 1, 0, 0, 0x80}));
  EXPECT_EQ(state.buttons, 0x80000001u);
  EXPECT_EQ(state.battery_percent, -1);
  ASSERT_TRUE(take_report(state, Report{0x17, 42}));
  EXPECT_EQ(state.battery_percent, 42);
}

TEST(SpaceMouseReport, ShortAndForeignReportsChangeNothing) {
  SpaceMouseState state;
  ASSERT_TRUE(take_report(state, kRight));
  for (const Report& report : {Report{}, Report{1}, Report{1, 0, 0, 0, 0, 0}, Report{2, 1, 1, 1}, Report{3}, Report{0x17}, Report{0x17, 200}, Report{9, 1, 2, 3}}) {
    EXPECT_FALSE(take_report(state, report));
  }
  EXPECT_EQ(state.push, Vec3(1, 0, 0));
  EXPECT_EQ(state.buttons, 0u);
  EXPECT_EQ(state.battery_percent, -1);
}

TEST(SpaceMouseReport, OverdrivenAxesStayWithinTheirRange) {
  SpaceMouseState state;
  ASSERT_TRUE(take_report(state, Report{1, 0xff, 0x7f, 0x00, 0x80, 0, 0}));
  EXPECT_EQ(state.push, Vec3(1, 0, -1));
}

TEST(RateControl, TheSameWayWhateverTheStep) {
  const RateControlParams params{.fastest_mm_per_s = 60, .fastest_rad_per_s = 1, .rest = 0.05, .reach_mm = 100};
  SpaceMouseState full;
  take_report(full, kRight);
  full.twist = {0, 0, 1};
  for (const int steps : {100, 500, 1000}) {
    RateControl rate(params);
    for (int i = 0; i < steps; ++i) rate.step(full, 1.0 / steps);
    EXPECT_NEAR((rate.pose().position_mm - Vec3(60, 0, 0)).norm(), 0.0, 1e-9);
    EXPECT_NEAR(rate.pose().rotation.angularDistance(Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Vec3::UnitZ()))), 0.0, 1e-9);
  }
}

TEST(RateControl, RestsAtRestAndBeginsWithoutAStep) {
  const RateControlParams params{.rest = 0.1};
  RateControl rate(params);
  SpaceMouseState state;
  state.push = {0.0999, 0, 0};
  state.twist = {0, 0.0999, 0};
  rate.step(state, 1.0);
  EXPECT_EQ(rate.pose().position_mm, Vec3::Zero());
  EXPECT_EQ(rate.pose().rotation.angularDistance(Eigen::Quaterniond::Identity()), 0.0);
  state.push = {0.1009, 0, 0};
  rate.step(state, 1.0);
  EXPECT_NEAR(rate.pose().position_mm.x(), 0.001 * params.fastest_mm_per_s, 1e-9);
  // Two axes at once are no faster than one.
  RateControl both(params);
  state.push = {1, 1, 0};
  both.step(state, 1.0);
  EXPECT_NEAR(both.pose().position_mm.norm(), params.fastest_mm_per_s, 1e-9);
}

TEST(RateControl, StaysInReach) {
  RateControl rate({.reach_mm = 50});
  SpaceMouseState state;
  state.push = {0, 1, 0};
  for (int i = 0; i < 5000; ++i) rate.step(state, 1e-3);
  EXPECT_NEAR(rate.pose().position_mm.norm(), 50.0, 1e-9);
  state.push = {0, -1, 0};
  rate.step(state, 0.1);
  EXPECT_LT(rate.pose().position_mm.norm(), 49.0);
}

}  // namespace
}  // namespace osteon::haptic
