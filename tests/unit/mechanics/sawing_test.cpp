#include "common/mechanics/sawing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace osteon {
namespace {

const GramsPerCm3 kCorticalBone{1.9};
const RevolutionsPerMinute kStrokes{12'000};

// Published for single teeth in cortical bone: resultants of 8 to 11 N from 2.5 to 10 micrometres.
TEST(Sawing, ResultantLiesInThePublishedBand) {
  for (double depth = 2.5; depth <= 10.0; depth += 0.5) {
    const double resultant =
        std::hypot(tooth_thrust({}, depth, kCorticalBone).value(), tooth_cutting_force({}, kCorticalBone).value());
    EXPECT_GE(resultant, 8.0) << depth;
    EXPECT_LE(resultant, 11.0) << depth;
  }
}

// Published: thrust 30 % more at 10 than at 2 micrometres, linearly.
TEST(Sawing, ThrustRisesByThirtyPercent) {
  const double low = tooth_thrust({}, 2.0, kCorticalBone).value(), high = tooth_thrust({}, 10.0, kCorticalBone).value();
  EXPECT_NEAR(high / low, 1.30, 1e-12);
  EXPECT_NEAR(tooth_thrust({}, 6.0, kCorticalBone).value(), 0.5 * (low + high), 1e-12);
}

// Published: at one depth of cut the speed of the blade has no effect. Here: twice the strokes at twice the feed.
TEST(Sawing, SpeedHasNoEffectAtTheSameDepth) {
  const FeedLaw slow = sawing_law({}, kStrokes, kCorticalBone, 10);
  const FeedLaw fast = sawing_law({}, RevolutionsPerMinute{24'000}, kCorticalBone, 10);
  EXPECT_NEAR(resistance_n(slow, 1.0), resistance_n(fast, 2.0), 1e-9);
}

// The bearing teeth take what the kerf grows by: feed · pitch · teeth = share · teeth · depth · speed.
TEST(Sawing, DepthOfCutConservesVolume) {
  const SawingParams saw;
  const double feed = 1.3, teeth = 11.0, kerf_width = 1.0;
  const double depth_mm = 1e-3 * depth_of_cut_um(saw, kStrokes, MillimetresPerSecond{feed});
  const double grown = feed * teeth * saw.tooth_pitch_mm * kerf_width;
  const double taken = saw.bearing_share * teeth * depth_mm * kerf_width * tooth_speed(saw, kStrokes).value();
  EXPECT_NEAR(taken, grown, 1e-9 * grown);
}

TEST(Sawing, TheLawIsTheTeethTogether) {
  const SawingParams saw;
  const FeedLaw law = sawing_law(saw, kStrokes, kCorticalBone, 12);
  const double depth = depth_of_cut_um(saw, kStrokes, MillimetresPerSecond{2.0});
  EXPECT_NEAR(resistance_n(law, 2.0), 0.15 * 12 * tooth_thrust(saw, depth, kCorticalBone).value(), 1e-9);
  EXPECT_NEAR(feed_at_mm_per_s(law, resistance_n(law, 2.0)), 2.0, 1e-9);
  // The gullets are full at 20 micrometres.
  EXPECT_NEAR(depth_of_cut_um(saw, kStrokes, MillimetresPerSecond{law.max_feed_mm_per_s}), 20.0, 1e-9);
}

TEST(Sawing, FewerTeethSofterBoneAndSharperOnesNeedLess) {
  const double at = resistance_n(sawing_law({}, kStrokes, kCorticalBone, 10), 1.0);
  EXPECT_NEAR(resistance_n(sawing_law({}, kStrokes, kCorticalBone, 5), 1.0), 0.5 * at, 1e-9);
  EXPECT_NEAR(resistance_n(sawing_law({}, kStrokes, GramsPerCm3{0.95}, 10), 1.0), at / 2.272, 1e-3 * at);
  EXPECT_NEAR(resistance_n(sawing_law({.wear = 2.0}, kStrokes, kCorticalBone, 10), 1.0), 2.0 * at, 1e-9);
}

TEST(Sawing, ABladeThatStandsDoesNotCut) {
  EXPECT_EQ(sawing_law({}, RevolutionsPerMinute{0}, kCorticalBone, 10).max_feed_mm_per_s, 0.0);
  EXPECT_EQ(sawing_law({}, kStrokes, kCorticalBone, 0).max_feed_mm_per_s, 0.0);
}

// The crank's torque does the work of the teeth: 2 pi M a period = force · twice the stroke.
TEST(Sawing, TorqueDoesTheWorkOfTheTeeth) {
  const SawingParams saw;
  const double work = 0.15 * 12 * tooth_cutting_force(saw, kCorticalBone).value() * 2.0 * saw.stroke_mm;
  EXPECT_NEAR(2.0 * std::numbers::pi * sawing_torque(saw, kCorticalBone, 12).value(), work, 1e-9);
}

}  // namespace
}  // namespace osteon
