#include "common/mechanics/feed_law.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/mechanics/drilling.hpp"

namespace osteon {
namespace {

constexpr double kStiffness = 50.0, kStep_s = 1e-3;
const FeedLaw kCorticalLaw = drilling_law({}, RevolutionsPerMinute{1000}, GramsPerCm3{1.9}, 1.0);

TEST(FeedLaw, SolutionBalancesCouplingAndResistance) {
  for (const double extension : {0.05, 0.2, 0.58, 0.7}) {
    const FeedSolution solution = solve_feed(kCorticalLaw, kStiffness, extension, kStep_s);
    EXPECT_NEAR(kStiffness * (extension - solution.feed_mm_per_s * kStep_s),
                resistance_n(kCorticalLaw, solution.feed_mm_per_s), 1e-6);
    EXPECT_FALSE(solution.rubbing);
  }
}

// A linear law has a closed form: v = K e / (c + K dt).
TEST(FeedLaw, LinearLawHasItsClosedForm) {
  const FeedLaw law{.scale_n = 0.8, .exponent = 1.0, .max_feed_mm_per_s = 1e6, .threshold_n = 0.0};
  EXPECT_NEAR(solve_feed(law, kStiffness, 0.1, kStep_s).feed_mm_per_s, 5.0 / (0.8 + 0.05), 1e-9);
}

TEST(FeedLaw, PushingHarderDrillsFasterUntilTheHeelTouches) {
  double before = 0.0;
  for (double extension = 0.1; extension < 2.0; extension += 0.1) {
    const double feed = solve_feed(kCorticalLaw, kStiffness, extension, kStep_s).feed_mm_per_s;
    EXPECT_GT(feed, before);
    before = feed;
  }
  const FeedSolution hard = solve_feed(kCorticalLaw, kStiffness, 5.0, kStep_s);
  EXPECT_TRUE(hard.heel_contact);
  EXPECT_EQ(hard.feed_mm_per_s, kCorticalLaw.max_feed_mm_per_s);
}

TEST(FeedLaw, BelowTheThresholdItRubs) {
  const FeedSolution soft = solve_feed(kCorticalLaw, kStiffness, 0.95 / kStiffness, kStep_s);
  EXPECT_TRUE(soft.rubbing);
  EXPECT_EQ(soft.feed_mm_per_s, 0.0);
  EXPECT_GT(solve_feed(kCorticalLaw, kStiffness, 1.05 / kStiffness, kStep_s).feed_mm_per_s, 0.0);
}

TEST(FeedLaw, NeverOvertakesTheDevice) {
  const FeedLaw nothing{.scale_n = 0.0, .exponent = 0.5, .max_feed_mm_per_s = 1e6, .threshold_n = 0.0};
  EXPECT_LE(solve_feed(nothing, kStiffness, 0.01, kStep_s).feed_mm_per_s * kStep_s, 0.01 + 1e-15);
  EXPECT_EQ(solve_feed(kCorticalLaw, kStiffness, -0.1, kStep_s).feed_mm_per_s, 0.0);
}

// A law with an offset: v = (K e - offset) / (c + K dt).
TEST(FeedLaw, AnOffsetHasItsClosedForm) {
  const FeedLaw law{.offset_n = 5.0, .scale_n = 24.0, .exponent = 1.0, .max_feed_mm_per_s = 1e6, .threshold_n = 0.0};
  for (const double extension : {0.11, 0.2, 1.0}) {
    const FeedSolution solution = solve_feed(law, kStiffness, extension, kStep_s);
    EXPECT_NEAR(solution.feed_mm_per_s, (kStiffness * extension - 5.0) / (24.0 + kStiffness * kStep_s), 1e-9);
    EXPECT_NEAR(solution.cutting_n, 5.0 + 24.0 * solution.feed_mm_per_s, 1e-9);
  }
  for (const double extension : {0.05, 0.0999, 0.1}) {
    const FeedSolution solution = solve_feed(law, kStiffness, extension, kStep_s);
    EXPECT_TRUE(solution.rubbing) << extension;
    EXPECT_EQ(solution.feed_mm_per_s, 0.0);
    EXPECT_EQ(solution.cutting_n, 0.0);
  }
}

// v^(1/2) and v^2 with an offset solve quadratics.
TEST(FeedLaw, RootsAndSquaresHaveTheirClosedForms) {
  const double k = kStiffness, kt = kStiffness * kStep_s, b = 4.0, offset = 3.0;
  for (const double extension : {0.07, 0.3, 0.9}) {
    const double c = k * extension - offset;
    const FeedLaw root{.offset_n = offset, .scale_n = b, .exponent = 0.5, .max_feed_mm_per_s = 1e6, .threshold_n = 0.0};
    const double s = (-b + std::sqrt(b * b + 4.0 * kt * c)) / (2.0 * kt);  // kt s^2 + b s - c = 0, v = s^2
    const double most = extension / kStep_s;
    EXPECT_NEAR(solve_feed(root, k, extension, kStep_s).feed_mm_per_s, std::min(s * s, most), 1e-6 * s * s);
    const FeedLaw square{
        .offset_n = offset, .scale_n = b, .exponent = 2.0, .max_feed_mm_per_s = 1e6, .threshold_n = 0.0};
    const double v = (-kt + std::sqrt(kt * kt + 4.0 * b * c)) / (2.0 * b);  // b v^2 + kt v - c = 0
    EXPECT_NEAR(solve_feed(square, k, extension, kStep_s).feed_mm_per_s, v, 1e-9);
  }
}

// For every law the balance holds within the bracket. Otherwise the cap or the device's own way limits the feed.
TEST(FeedLaw, EveryOffsetAndPowerIsBracketed) {
  for (const double exponent : {0.163, 0.5189, 1.0, 1.5, 3.0})
    for (const double offset : {0.0, 0.3, 12.0})
      for (const double scale : {1e-6, 0.1, 30.0, 1e5})
        for (const double cap : {1e-3, 2.0, 1e4})
          for (const double stiffness : {0.5, 50.0, 200.0})
            for (const double extension : {1e-6, 0.03, 0.6, 5.0}) {
              const FeedLaw law{offset, scale, exponent, cap, 0.0};
              const FeedSolution solution = solve_feed(law, stiffness, extension, kStep_s);
              const double v = solution.feed_mm_per_s;
              ASSERT_GE(v, 0.0);
              ASSERT_LE(v, cap);
              ASSERT_LE(v * kStep_s, extension * (1.0 + 1e-12));
              if (stiffness * extension <= offset) {
                ASSERT_EQ(v, 0.0);
              } else {
                // Never more than the coupling's force. If no cap limits, a little more feed would need too much.
                const auto left = [&](double feed) {
                  return stiffness * (extension - feed * kStep_s) - resistance_n(law, feed);
                };
                if (v > 0.0) {
                  ASSERT_GE(left(v), -1e-9 * stiffness * extension);
                }
                const double most = std::min(cap, extension / kStep_s);
                if (v < most) {
                  ASSERT_LE(left(v + 1e-12 * most), 1e-9 * stiffness * extension) << exponent << " " << scale;
                }
              }
            }
}

TEST(FeedLaw, InvertsItself) {
  for (const double exponent : {0.163, 0.5189, 1.0, 2.0}) {
    const FeedLaw law{
        .offset_n = 2.0, .scale_n = 7.0, .exponent = exponent, .max_feed_mm_per_s = 10.0, .threshold_n = 0.0};
    for (const double v : {0.01, 1.0, 30.0}) EXPECT_NEAR(feed_at_mm_per_s(law, resistance_n(law, v)), v, 1e-9 * v);
    EXPECT_EQ(feed_at_mm_per_s(law, 2.0), 0.0);
    EXPECT_EQ(feed_at_mm_per_s(law, -1.0), 0.0);
    EXPECT_EQ(resistance_n(law, 0.0), 0.0);  // nothing resists a tool at rest
  }
}

TEST(FeedLaw, AScaledLawResistsInProportion) {
  const FeedLaw law{.offset_n = 2.0, .scale_n = 7.0, .exponent = 0.5, .max_feed_mm_per_s = 10.0, .threshold_n = 1.0};
  const FeedLaw twice = scaled(law, 2.0);
  EXPECT_NEAR(resistance_n(twice, 3.0), 2.0 * resistance_n(law, 3.0), 1e-12);
  EXPECT_EQ(twice.threshold_n, 2.0);
  EXPECT_EQ(twice.max_feed_mm_per_s, 10.0);
}

}  // namespace
}  // namespace osteon
