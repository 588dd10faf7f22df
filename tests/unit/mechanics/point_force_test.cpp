#include "common/mechanics/point_force.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace osteon {
namespace {

constexpr double kChiCortical = 28.9;  // N at 1000 rpm, 1 mm/s, 1.9 g/cm3

TEST(SpringDamper, FitsTheDrillAtOneMillimetreASecond) {
  EXPECT_NEAR(spring_damper_thrust_n({}, 1.0, 1.9), kChiCortical, 0.01 * kChiCortical);
}

TEST(SpringDamper, InverseUndoesForwardAndNothingMovesBelowTheSpring) {
  for (const double v : {0.2, 1.0, 4.0})
    EXPECT_NEAR(spring_damper_feed_mm_per_s({}, spring_damper_thrust_n({}, v, 1.2), 1.2), v, 1e-12);
  EXPECT_EQ(spring_damper_feed_mm_per_s({}, 4.9, 1.9), 0.0);
  EXPECT_NEAR(spring_damper_feed_mm_per_s({}, 29.0, 1.9), 1.0, 1e-12);
  EXPECT_NEAR(spring_damper_feed_mm_per_s({.wear = 2.0}, 58.0, 1.9), 1.0, 1e-12);
}

TEST(SpringDamper, ResistsMotionAndPushesAlongTheNormal) {
  const Vec3 force = spring_damper_force_n({}, {0, 0, -2}, {0, 0, 0.01}, 1.9);
  EXPECT_NEAR((force - Vec3(0, 0, 5.0 + 48.0)).norm(), 0.0, 1e-9);
  // Sliding: the damper is along the motion, the spring along the normal.
  const Vec3 sliding = spring_damper_force_n({}, {3, 0, 0}, {0, 2, 0}, 1.9);
  EXPECT_NEAR((sliding - Vec3(-72.0, 5.0, 0)).norm(), 0.0, 1e-9);
}

TEST(SpringDamper, LeavesTheSpringOutWhereTheGradientVanishes) {
  const Vec3 force = spring_damper_force_n({}, {0, 0, -1}, Vec3::Zero(), 1.9);
  EXPECT_TRUE(force.allFinite());
  EXPECT_NEAR((force - Vec3(0, 0, 24.0)).norm(), 0.0, 1e-9);
}

// Points spread evenly round a cone of that full angle, moving at `velocity`.
std::vector<CuttingPoint> cone(double angle_rad, const Vec3& velocity, double density, int count = 36) {
  std::vector<CuttingPoint> points;
  for (int i = 0; i < count; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / count;
    const Vec3 outward(std::cos(turn) * std::cos(0.5 * angle_rad), std::sin(turn) * std::cos(0.5 * angle_rad),
                       std::sin(0.5 * angle_rad));
    points.push_back({-outward, velocity, 1.0 / count, density});
  }
  return points;
}

// A drill's point: the sides of the cone cancel, along the axis K1 D v sin(beta/2) is left, fitted to Chi.
TEST(MultiPoint, AConeFitsTheDrillAndPushesAlongItsAxis) {
  const double angle = 118.0 * std::numbers::pi / 180.0;
  const Vec3 force = multi_point_force_n({}, cone(angle, {0, 0, 1}, 1.9));
  EXPECT_NEAR(force.z(), -17.7 * 1.9 * std::sin(0.5 * angle), 1e-9);
  EXPECT_NEAR(-force.z(), kChiCortical, 0.01 * kChiCortical);
  EXPECT_NEAR(force.head<2>().norm(), 0.0, 1e-9);
}

TEST(MultiPoint, IsProportionalToSpeedDensityAndWear) {
  const Vec3 at = multi_point_force_n({}, cone(2.0, {0, 0, 1}, 1.0));
  EXPECT_NEAR((multi_point_force_n({}, cone(2.0, {0, 0, 3}, 1.0)) - 3.0 * at).norm(), 0.0, 1e-9);
  EXPECT_NEAR((multi_point_force_n({}, cone(2.0, {0, 0, 1}, 0.5)) - 0.5 * at).norm(), 0.0, 1e-9);
  EXPECT_NEAR((multi_point_force_n({.wear = 2.0}, cone(2.0, {0, 0, 1}, 1.0)) - 2.0 * at).norm(), 0.0, 1e-9);
}

// As printed, (7.12) would push a drill that is drawn back.
TEST(MultiPoint, DoesNotPushDuringRetraction) {
  EXPECT_EQ(multi_point_force_n({}, cone(2.0, {0, 0, -1}, 1.9)).norm(), 0.0);
}

// Every point's power is taken from the motion: F · v <= 0 whatever the direction.
TEST(MultiPoint, NeverGivesEnergy) {
  for (int i = 0; i < 50; ++i) {
    const Vec3 v(std::sin(1.0 * i), std::cos(2.3 * i), std::sin(0.7 * i + 1.0));
    EXPECT_LE(multi_point_force_n({}, cone(1.5, v, 1.9)).dot(v), 0.0);
  }
}

// Points of different density: more resistance on the denser side, so a sideways force away from it.
TEST(MultiPoint, ADenserSidePushesTheToolAway) {
  auto points = cone(2.0, {0, 0, 1}, 1.0);
  for (CuttingPoint& point : points)
    if (point.inward.x() < 0.0) point.density_g_cm3 = 1.9;  // bone at +x
  EXPECT_LT(multi_point_force_n({}, points).x(), 0.0);
}

TEST(MultiPoint, InverseUndoesForward) {
  const double directed = 1.9 * std::sin(1.0);
  const double force = -multi_point_force_n({}, cone(2.0, {0, 0, 0.7}, 1.9)).z();
  EXPECT_NEAR(multi_point_feed_mm_per_s({}, force, directed), 0.7, 1e-12);
  EXPECT_EQ(multi_point_feed_mm_per_s({}, 1.0, 0.0), 0.0);
}

}  // namespace
}  // namespace osteon
