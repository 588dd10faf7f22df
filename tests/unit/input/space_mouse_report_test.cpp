// A SpaceMouse's reports.
#include "common/input/space_mouse_report.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace osteon {
namespace {

using Report = std::vector<std::uint8_t>;

// 350 = 0x015e, −350 = 0xfea2, 175 = 0x00af.
const Report kRight{1, 0x5e, 0x01, 0, 0, 0, 0}, kTowardsUser{1, 0, 0, 0x5e, 0x01, 0, 0},
    kDown{1, 0, 0, 0, 0, 0x5e, 0x01};

TEST(SpaceMouseReport, TheCapsAxesInTheDeviceFrame) {
  SpaceMouseState state;
  ASSERT_TRUE(take_report(state, kRight));
  EXPECT_EQ(state.push, Vec3(1, 0, 0));
  ASSERT_TRUE(take_report(state, kTowardsUser));
  EXPECT_EQ(state.push, Vec3(0, 0, 1));
  ASSERT_TRUE(take_report(state, kDown));
  EXPECT_EQ(state.push, Vec3(0, -1, 0));
  // The map keeps frames right-handed: x × y = z before and after.
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
  // Even longer, as wireless devices pad it.
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
  for (const Report& report : {Report{}, Report{1}, Report{1, 0, 0, 0, 0, 0}, Report{2, 1, 1, 1}, Report{3},
                               Report{0x17}, Report{0x17, 200}, Report{9, 1, 2, 3}}) {
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

TEST(SpaceMouseReport, RestHasNoStep) {
  EXPECT_EQ(beyond_rest(Vec3(0.05, 0.0, 0.0), 0.05), Vec3::Zero());
  EXPECT_NEAR(beyond_rest(Vec3(0.05001, 0.0, 0.0), 0.05).x(), 0.0, 2e-5);
  EXPECT_NEAR(beyond_rest(Vec3(0.525, 0.0, 0.0), 0.05).x(), 0.5, 1e-12);
  EXPECT_NEAR(beyond_rest(Vec3(1.0, -1.0, 1.0), 0.05).norm(), 1.0, 1e-12);
}

}  // namespace
}  // namespace osteon
