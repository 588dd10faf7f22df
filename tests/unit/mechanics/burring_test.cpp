#include "common/mechanics/burring.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace osteon {
namespace {

TEST(Agus, ElasticForceScalesAsHertzSays) {
  const AgusParams burr{.radius_mm = 2.5}, larger{.radius_mm = 5.0};
  const double at = agus_elastic_force(burr, 0.002).value();
  EXPECT_NEAR(agus_elastic_force(burr, 0.004).value() / at, 2.83, 5e-3);    // h x 2
  EXPECT_NEAR(agus_elastic_force(larger, 0.002).value() / at, 1.41, 5e-3);  // R x 2
  EXPECT_EQ(agus_elastic_force(burr, -0.001).value(), 0.0);
}

// Hertz for a rigid sphere: F = 4/3 E* sqrt(R) h^1.5.
TEST(Agus, IsHertzsContact) {
  const double h = 0.003, radius = 1.6;
  EXPECT_NEAR(agus_elastic_force({.radius_mm = radius}, h).value(), 25e3 * std::sqrt(radius) * std::pow(h, 1.5), 1e-9);
}

TEST(Agus, DepthUndoesForceAndIsMicrons) {
  for (const double force : {0.5, 3.0, 20.0}) {
    const double depth = agus_depth_mm({}, Newtons{force});
    EXPECT_NEAR(agus_elastic_force({}, depth).value(), force, 1e-9);
    EXPECT_LT(depth, 0.01);
  }
  EXPECT_EQ(agus_depth_mm({}, Newtons{-1.0}), 0.0);
}

// At the pole every direction occurs as often as its opposite. Far from it all directions are one, and friction is mu
// F.
TEST(Agus, FrictionVanishesAtThePoleAndIsCoulombsFarFromIt) {
  const AgusParams params;
  const Newtons normal{3.0};
  const double contact = std::sqrt(agus_depth_mm(params, normal) * params.radius_mm);
  EXPECT_NEAR(agus_friction(params, normal, 0.0).value(), 0.0, 1e-9);
  EXPECT_NEAR(agus_friction(params, normal, 40.0 * contact).value(), 0.9, 1e-3);
  double before = -1.0;
  for (double d = 0.0; d < 4.0 * contact; d += 0.2 * contact) {
    const double now = agus_friction(params, normal, d).value();
    EXPECT_GT(now, before);
    EXPECT_LE(now, 0.9);
    before = now;
  }
}

// Near the pole the mean of cos over Hertz's disc is linear in the distance d: <1/(2 s)> d with the load's weights
// 3 s sqrt(1 - s^2) ds, so mu F (3 pi / 8) d / a.
TEST(Agus, FrictionNearThePoleHasItsClosedForm) {
  const AgusParams params;
  const Newtons normal{3.0};
  const double contact = std::sqrt(agus_depth_mm(params, normal) * params.radius_mm), d = 0.1 * contact;
  EXPECT_NEAR(agus_friction(params, normal, d).value(), 0.9 * 3.0 * std::numbers::pi / 8.0 * 0.1,
              0.05 * 0.9 * 0.1 * 1.18);
}

// The sum over the disc near the pole and the series far from it must meet.
TEST(Agus, FrictionIsOneCurve) {
  const AgusParams params;
  const double contact = std::sqrt(agus_depth_mm(params, Newtons{3.0}) * params.radius_mm);
  const double inside = agus_friction(params, Newtons{3.0}, 3.999 * contact).value();
  EXPECT_NEAR(agus_friction(params, Newtons{3.0}, 4.001 * contact).value(), inside, 2e-4 * inside);
}

// The power of friction is the power of removal: mu F omega r = u A v.
TEST(Agus, ErosionBalancesPower) {
  const double v = agus_erosion({}, RevolutionsPerMinute{20'000}, Newtons{2.0}, 2.0, 6.0, GramsPerCm3{1.9}).value();
  const double friction_mw = 0.3 * 2.0 * (20'000 * 2.0 * std::numbers::pi / 60.0) * 2.0;  // N mm/s
  EXPECT_NEAR(friction_mw, 1000.0 * 6.0 * v, 1e-6);
}

TEST(Agus, ErosionScales) {
  const auto v = [](double rpm, double force, double arm, double area, double density, double wear = 1.0) {
    return agus_erosion({.wear = wear}, RevolutionsPerMinute{rpm}, Newtons{force}, arm, area, GramsPerCm3{density})
        .value();
  };
  const double at = v(20'000, 2, 2, 6, 1.8);
  EXPECT_NEAR(v(40'000, 2, 2, 6, 1.8), 2.0 * at, 1e-9);
  EXPECT_NEAR(v(20'000, 4, 2, 6, 1.8), 2.0 * at, 1e-9);
  EXPECT_NEAR(v(20'000, 2, 1, 6, 1.8), 0.5 * at, 1e-9);
  EXPECT_NEAR(v(20'000, 2, 2, 12, 1.8), 0.5 * at, 1e-9);
  EXPECT_NEAR(v(20'000, 2, 2, 6, 0.9), 2.272 * at, 1e-3 * at);
  EXPECT_NEAR(v(20'000, 2, 2, 6, 1.8, 2.0), 0.5 * at, 1e-9);
}

TEST(Agus, DoesNotCutAtThePole) {
  EXPECT_EQ(agus_erosion({}, RevolutionsPerMinute{20'000}, Newtons{5.0}, 0.0, 6.0, GramsPerCm3{1.9}).value(), 0.0);
}

}  // namespace
}  // namespace osteon
