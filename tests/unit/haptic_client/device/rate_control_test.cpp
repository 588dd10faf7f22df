// Rate control: the deflection of a cap is a velocity.
#include "haptic_client/device/rate_control.hpp"

#include <gtest/gtest.h>

namespace osteon::haptic {
namespace {

TEST(RateControl, TheSameWayWhateverTheStep) {
  const RateControlParams params{.fastest_mm_per_s = 60, .fastest_rad_per_s = 1, .rest = 0.05, .reach_mm = 100};
  SpaceMouseState full;
  full.push = {1, 0, 0};
  full.twist = {0, 0, 1};
  for (const int steps : {100, 500, 1000}) {
    RateControl rate(params);
    for (int i = 0; i < steps; ++i) rate.step(full, 1.0 / steps);
    EXPECT_NEAR((rate.pose().position_mm - Vec3(60, 0, 0)).norm(), 0.0, 1e-9);
    EXPECT_NEAR(rate.pose().rotation.angularDistance(Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Vec3::UnitZ()))), 0.0,
                1e-9);
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
  // Two axes at once are not faster than one.
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
