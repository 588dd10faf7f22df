#include "common/mechanics/drilling.hpp"

#include <gmock/gmock.h>

namespace osteon {
namespace {

double thrust(double rpm, double feed, double density, DrillingParams params = {}) {
  return resistance_n(drilling_law(params, RevolutionsPerMinute{rpm}, GramsPerCm3{density}, 1.0), feed);
}
double feed(double rpm, double force, double density) {
  return feed_at_mm_per_s(drilling_law({}, RevolutionsPerMinute{rpm}, GramsPerCm3{density}, 1.0), force);
}

// Points of comparison at 1000 rpm and 1 mm/s, published to one decimal place.
TEST(Drilling, GivesThePublishedThrusts) {
  const struct { double density, newtons; } kPoints[] = {{0.3, 3.2}, {0.5, 5.9}, {1.0, 13.5}, {1.8, 27.1}, {2.0, 30.7}};
  for (const auto& point : kPoints) EXPECT_NEAR(thrust(1000, 1, point.density), point.newtons, 0.06) << point.density;
}

TEST(Drilling, ScalesAsPublished) {
  const double at = thrust(1000, 1, 1.0);
  EXPECT_NEAR(thrust(2000, 1, 1.0) / at, 0.794, 5e-4);
  EXPECT_NEAR(thrust(1000, 2, 1.0) / at, 1.433, 5e-4);
  EXPECT_NEAR(thrust(1000, 1, 2.0) / at, 2.272, 5e-4);
}

TEST(Drilling, InverseScalesAsPublished) {
  const double at = feed(1000, 10, 0.9);
  EXPECT_NEAR(feed(1000, 20, 0.9) / at, 3.80, 5e-3);
  EXPECT_NEAR(feed(2000, 10, 0.9) / at, 1.56, 5e-3);
  EXPECT_NEAR(feed(1000, 10, 1.8) / at, 0.206, 5e-4);
}

TEST(Drilling, InverseUndoesForward) {
  for (const double v : {0.1, 1.0, 10.0}) EXPECT_NEAR(feed(1500, thrust(1500, v, 1.4), 1.4), v, 1e-9 * v);
}

TEST(Drilling, ABluntAndAThickDrillNeedMoreThrust) {
  EXPECT_NEAR(thrust(1000, 1, 1.9, {.wear = 2.0}), 2.0 * thrust(1000, 1, 1.9), 1e-9);
  EXPECT_NEAR(thrust(1000, 1, 1.9, {.diameter_mm = 4.8}), 1.5 * thrust(1000, 1, 1.9), 1e-9);
}

// A drill that needs twice the thrust at every feed also rubs up to twice the force. The force below which a sharp
// drill of 3.2 mm rubs at 1.9 g/cm3 is a parameter.
TEST(Drilling, ABluntDrillRubsUpToMoreForce) {
  constexpr double kStiffness = 10.0;
  const double sharp_n = DrillingParams{}.threshold_n;
  const auto rubs = [&](double wear, double force_n) {
    const FeedLaw law = drilling_law({.wear = wear}, RevolutionsPerMinute{1000}, GramsPerCm3{1.9}, 1.0);
    return solve_feed(law, kStiffness, force_n / kStiffness, 1e-3).rubbing;
  };
  for (const double wear : {1.0, 1.5, 2.0}) {
    EXPECT_TRUE(rubs(wear, 0.95 * wear * sharp_n)) << wear;
    EXPECT_FALSE(rubs(wear, 1.05 * wear * sharp_n)) << wear;
  }
}

TEST(Drilling, TorqueAtTheCorticalPoint) {
  const Newtons t{thrust(1000, 1, 1.9)};
  EXPECT_NEAR(drilling_torque({}, t).value(), 27.0, 0.1);
}

TEST(Drilling, HeelTouchesAtAThirdOfADiameterPerTurn) {
  EXPECT_NEAR(drilling_law({}, RevolutionsPerMinute{1000}, GramsPerCm3{1.9}, 1.0).max_feed_mm_per_s, 17.6, 1e-9);
}

TEST(Drilling, AStandingSpindleDoesNotCut) {
  EXPECT_EQ(thrust(0, 1, 1.9), 0.0);
  EXPECT_EQ(feed(0, 10, 1.9), 0.0);
  EXPECT_EQ(drilling_law({}, RevolutionsPerMinute{0}, GramsPerCm3{1.9}, 1.0).max_feed_mm_per_s, 0.0);
}

}  // namespace
}  // namespace osteon
