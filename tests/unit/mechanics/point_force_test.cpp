#include "common/mechanics/point_force.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace osteon {
namespace {

constexpr double kChiCortical = 28.9;  // N at 1000 rpm, 1 mm/s, 1.9 g/cm3

TEST(SpringDamper, FitsTheDrillAtOneMillimetreASecond) {
  EXPECT_NEAR(spring_damper_thrust_n({}, 1.0, 1.9), kChiCortical, 0.01 * kChiCortical);
}

// t_s at the edge of rest, and t_r more for each millimetre a second, both times the wear and (rho/1.9)^1.1841.
TEST(SpringDamper, IsASpringAndADamper) {
  EXPECT_NEAR(spring_damper_thrust_n({}, 1e-9, 1.9), 5.0, 1e-6);
  EXPECT_NEAR(spring_damper_thrust_n({}, 3.0, 1.9), 5.0 + 72.0, 1e-9);
  EXPECT_NEAR(spring_damper_thrust_n({.wear = 2.0}, 3.0, 1.9), 154.0, 1e-9);
  EXPECT_NEAR(spring_damper_thrust_n({}, 3.0, 0.95) * 2.272, 77.0, 0.01);
  EXPECT_EQ(spring_damper_thrust_n({}, 0.0, 1.9), 0.0);
}

// At a drill's point the sides of the cone cancel. Along the axis K1 D v sin(beta/2) is left, fitted to Chi.
TEST(MultiPoint, AConeFitsTheDrill) {
  const double directed = 1.9 * std::sin(59.0 * std::numbers::pi / 180.0);
  EXPECT_NEAR(multi_point_feed_mm_per_s({}, kChiCortical, directed), 1.0, 0.01);
}

// F = K1 v sum K2 D max(0, -n f), solved for v.
TEST(MultiPoint, HasItsClosedForm) {
  EXPECT_NEAR(multi_point_feed_mm_per_s({}, 17.7 * 0.4 * 3.0, 0.4), 3.0, 1e-12);
  EXPECT_NEAR(multi_point_feed_mm_per_s({.wear = 2.0}, 17.7 * 0.4 * 3.0, 0.4), 1.5, 1e-12);
  EXPECT_EQ(multi_point_feed_mm_per_s({}, 1.0, 0.0), 0.0);
  EXPECT_EQ(multi_point_feed_mm_per_s({}, -1.0, 0.4), 0.0);
}

}  // namespace
}  // namespace osteon
