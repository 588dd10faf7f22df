#include "common/mechanics/milling.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace osteon {
namespace {

const RevolutionsPerMinute kSpeed{20000.0};

constexpr double kEdge_mm = 20.0;
// Resistance of one face of 2 mm² at the equator of a 5 mm burr, moved at `v` mm/s.
double force(double v, MillingParams params = {}, RevolutionsPerMinute speed = kSpeed, double edge_mm = kEdge_mm) {
  return resistance_n(milling_law(params, speed, milling_resistance(params, 2.0, 2.5, 1.9), edge_mm, GramsPerCm3{1.9}),
                      v);
}

// (7.7): F_t = K_t · MRR / v_c + k_e L.
TEST(Milling, ForceIsRemovalRateOverCuttingSpeedAndTheEdges) {
  const double cutting_speed = 20000.0 * 2.0 * std::numbers::pi / 60.0 * 2.5;
  EXPECT_NEAR(force(10.0, {}, kSpeed, 0.0), 200.0 * 2.0 * 10.0 / cutting_speed, 1e-9);
  EXPECT_NEAR(force(10.0), 200.0 * 2.0 * 10.0 / cutting_speed + 0.2, 1e-9);
  EXPECT_NEAR(milling_ploughing({}, kEdge_mm, GramsPerCm3{1.9}).value(), 0.2, 1e-12);
}

TEST(Milling, FasterSpindleCutsLighter) {
  const double slow = force(10.0, {}, kSpeed, 0.0);
  EXPECT_NEAR(force(10.0, {}, RevolutionsPerMinute{40000.0}, 0.0), 0.5 * slow, 1e-9);
}

TEST(Milling, ThePoleResistsMoreThanTheEquator) {
  EXPECT_GT(milling_resistance({}, 1.0, 0.0, 1.9), 5.0 * milling_resistance({}, 1.0, 2.5, 1.9));
}

TEST(Milling, AStandingBurrDoesNotCut) {
  EXPECT_EQ(milling_law({}, RevolutionsPerMinute{0.0}, 1.0, kEdge_mm, GramsPerCm3{1.9}).max_feed_mm_per_s, 0.0);
}

// A turn advances by no more than the teeth protrude: 0.1 mm at 20 000 rpm is 33 mm/s.
TEST(Milling, TeethLimitTheFeed) {
  const FeedLaw law = milling_law({.heel_mm_per_rev = 0.1}, kSpeed, 1.0, kEdge_mm, GramsPerCm3{1.9});
  EXPECT_NEAR(law.max_feed_mm_per_s, 100.0 / 3.0, 1e-9);
}

// (7.8): F_r = K_r of what cuts.
TEST(Milling, RadialForce) { EXPECT_NEAR(milling_radial({}, Newtons{3.0}).value(), 1.5, 1e-12); }

TEST(Milling, InverseUndoesForward) {
  const FeedLaw law = milling_law({}, kSpeed, milling_resistance({}, 2.0, 2.5, 1.9), kEdge_mm, GramsPerCm3{1.9});
  for (const double v : {0.5, 10.0, 80.0}) EXPECT_NEAR(feed_at_mm_per_s(law, force(v)), v, 1e-9 * v);
  EXPECT_EQ(feed_at_mm_per_s(law, 0.19), 0.0);  // the edges only plough
}

// In the printed form, with the feed below the fraction, the force would be K_t times the swept area at any feed. Here
// it grows with the feed.
TEST(Milling, DependsOnTheFeedAsThePrintedFormDoesNot) {
  EXPECT_NEAR(force(20.0, {}, kSpeed, 0.0), 2.0 * force(10.0, {}, kSpeed, 0.0), 1e-9);
  EXPECT_NEAR(force(10.0, {.wear = 2.0}), 2.0 * force(10.0), 1e-9);
}

}  // namespace
}  // namespace osteon
