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

}  // namespace
}  // namespace osteon
