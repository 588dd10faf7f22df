#include "common/mechanics/feed_law.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/mechanics/drilling.hpp"

namespace osteon {
namespace {

constexpr double kStiffness = 50.0, kDt = 1e-3;
const FeedLaw kCortical = drilling_law({}, RevolutionsPerMinute{1000}, GramsPerCm3{1.9}, 1.0);

TEST(FeedLaw, SolutionBalancesCouplingAndResistance) {
  for (const double extension : {0.05, 0.2, 0.58, 0.7}) {
    const FeedSolution solution = solve_feed(kCortical, kStiffness, extension, kDt);
    EXPECT_NEAR(kStiffness * (extension - solution.feed_mm_per_s * kDt), resistance_n(kCortical, solution.feed_mm_per_s), 1e-6);
    EXPECT_FALSE(solution.rubbing);
  }
}

// A linear law has a closed form: v = K e / (c + K dt).
TEST(FeedLaw, LinearLawHasItsClosedForm) {
  const FeedLaw law{.scale_n = 0.8, .exponent = 1.0, .max_feed_mm_per_s = 1e6, .threshold_n = 0.0};
  EXPECT_NEAR(solve_feed(law, kStiffness, 0.1, kDt).feed_mm_per_s, 5.0 / (0.8 + 0.05), 1e-9);
}

TEST(FeedLaw, PushingHarderDrillsFasterUntilTheHeelTouches) {
  double before = 0.0;
  for (double extension = 0.1; extension < 2.0; extension += 0.1) {
    const double feed = solve_feed(kCortical, kStiffness, extension, kDt).feed_mm_per_s;
    EXPECT_GT(feed, before);
    before = feed;
  }
  const FeedSolution hard = solve_feed(kCortical, kStiffness, 5.0, kDt);
  EXPECT_TRUE(hard.heel_contact);
  EXPECT_EQ(hard.feed_mm_per_s, kCortical.max_feed_mm_per_s);
}

TEST(FeedLaw, BelowTheThresholdItRubs) {
  const FeedSolution soft = solve_feed(kCortical, kStiffness, 0.95 / kStiffness, kDt);
  EXPECT_TRUE(soft.rubbing);
  EXPECT_EQ(soft.feed_mm_per_s, 0.0);
  EXPECT_GT(solve_feed(kCortical, kStiffness, 1.05 / kStiffness, kDt).feed_mm_per_s, 0.0);
}

TEST(FeedLaw, NeverOvertakesTheDevice) {
  const FeedLaw nothing{.scale_n = 0.0, .exponent = 0.5, .max_feed_mm_per_s = 1e6, .threshold_n = 0.0};
  EXPECT_LE(solve_feed(nothing, kStiffness, 0.01, kDt).feed_mm_per_s * kDt, 0.01 + 1e-15);
  EXPECT_EQ(solve_feed(kCortical, kStiffness, -0.1, kDt).feed_mm_per_s, 0.0);
}

}  // namespace
}  // namespace osteon
