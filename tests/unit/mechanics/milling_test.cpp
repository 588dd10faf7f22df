#include "common/mechanics/milling.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace osteon {
namespace {

const RevolutionsPerMinute kSpeed{20000.0};

// (7.7): F = K_t · MRR / v_c for a face of 2 mm² at the equator of a 5 mm burr, moved at 10 mm/s.
TEST(Milling, ForceIsRemovalRateOverCuttingSpeed) {
  const double sum = milling_resistance({}, 2.0, 2.5, 1.9);
  const FeedLaw law = milling_law({}, kSpeed, sum, GramsPerCm3{1.9}, 0.5);
  const double cutting_speed = 20000.0 * 2.0 * std::numbers::pi / 60.0 * 2.5;
  EXPECT_NEAR(resistance_n(law, 10.0), 200.0 * 2.0 * 10.0 / cutting_speed, 1e-9);
  EXPECT_NEAR(resistance_n(law, 20.0), 2.0 * resistance_n(law, 10.0), 1e-9);
}

TEST(Milling, FasterSpindleCutsLighter) {
  const double sum = milling_resistance({}, 2.0, 2.5, 1.9);
  const double slow = resistance_n(milling_law({}, kSpeed, sum, GramsPerCm3{1.9}, 0.5), 10.0);
  const double fast = resistance_n(milling_law({}, RevolutionsPerMinute{40000.0}, sum, GramsPerCm3{1.9}, 0.5), 10.0);
  EXPECT_NEAR(fast, 0.5 * slow, 1e-9);
}

TEST(Milling, ThePoleResistsMoreThanTheEquator) {
  EXPECT_GT(milling_resistance({}, 1.0, 0.0, 1.9), 5.0 * milling_resistance({}, 1.0, 2.5, 1.9));
}

TEST(Milling, AStandingBurrDoesNotCut) {
  EXPECT_EQ(milling_law({}, RevolutionsPerMinute{0.0}, 1.0, GramsPerCm3{1.9}, 1.0).max_feed_mm_per_s, 0.0);
}

const MilledFace kFace{.area_mm2 = 2.0, .axis_distance_mm = 2.5, .edge_length_mm = 20.0, .density = GramsPerCm3{1.9}};

// F_t = K_t MRR / v_c + k_e L, F_r = K_r of what cuts.
TEST(Milling, TangentialAndRadialForce) {
  const double cutting_speed = 20000.0 * 2.0 * std::numbers::pi / 60.0 * 2.5;
  const double cutting = 200.0 * 2.0 * 10.0 / cutting_speed;
  EXPECT_NEAR(milling_tangential({}, kSpeed, MillimetresPerSecond{10.0}, kFace).value(), cutting + 0.2, 1e-9);
  EXPECT_NEAR(milling_radial({}, Newtons{cutting}).value(), 0.5 * cutting, 1e-12);
}

TEST(Milling, InverseUndoesForward) {
  for (const double v : {0.5, 10.0, 80.0}) {
    const Newtons force = milling_tangential({}, kSpeed, MillimetresPerSecond{v}, kFace);
    EXPECT_NEAR(milling_feed({}, kSpeed, force, kFace).value(), v, 1e-9 * v);
  }
  EXPECT_EQ(milling_feed({}, kSpeed, Newtons{0.19}, kFace).value(), 0.0);  // the edges only plough
}

// As printed, with the feed below the fraction, the force would be K_t times the swept area at any feed: here it grows.
TEST(Milling, DependsOnTheFeedAsThePrintedFormDoesNot) {
  const MillingParams smooth{.edge_n_per_mm = 0.0};
  const auto force = [&](double v, double wear = 1.0) {
    MillingParams params = smooth;
    params.wear = wear;
    return milling_tangential(params, kSpeed, MillimetresPerSecond{v}, kFace).value();
  };
  EXPECT_NEAR(force(20.0), 2.0 * force(10.0), 1e-9);
  EXPECT_NEAR(force(10.0, 2.0), 2.0 * force(10.0), 1e-9);
}

}  // namespace
}  // namespace osteon
