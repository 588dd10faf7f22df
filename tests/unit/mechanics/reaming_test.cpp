#include "common/mechanics/reaming.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "common/mechanics/broaching.hpp"
#include "common/mechanics/milling.hpp"

namespace osteon {
namespace {

const GramsPerCm3 kSubchondral{0.9};
const RevolutionsPerMinute kReamerSpeed{250};

double thrust(const ReamingParams& reamer, double feed, double edge_mm, GramsPerCm3 density,
              RevolutionsPerMinute speed = kReamerSpeed) {
  return resistance_n(reaming_law(reamer, speed, edge_mm, density), feed);
}

// Another way to compute it: the milling law of the whole face, ring by ring, whose radial part is the reamer's thrust.
TEST(Reaming, IsMillingAlongTheAxis) {
  const double radius = 25.0, teeth = 40.0, feed = 0.7;
  const ReamingParams reamer{.teeth = teeth, .edge_n_per_mm = 0.0};
  double tangential = 0.0;
  const int rings = 200;
  for (int i = 0; i < rings; ++i) {
    const double width = radius / rings, r = (i + 0.5) * width;
    const MillingParams mill{.diameter_mm = 2.0 * radius, .pole_radius = 0.0, .edge_n_per_mm = 0.0};
    const double ring = milling_resistance(mill, 2.0 * std::numbers::pi * r * width, r, kSubchondral.value());
    tangential += resistance_n(milling_law(mill, kReamerSpeed, ring, teeth * width, kSubchondral), feed);
  }
  EXPECT_NEAR(thrust(reamer, feed, teeth * radius, kSubchondral), 0.5 * tangential, 1e-9 * tangential);
}

// K_r K_t t L by hand: 0.5 · 200 · (60 · 0.5 / (250 · 40)) · 1000 at 1.9 g/cm3.
TEST(Reaming, HasItsClosedForm) {
  const ReamingParams reamer{.teeth = 40, .edge_n_per_mm = 0.0};
  EXPECT_NEAR(thrust(reamer, 0.5, 1000.0, GramsPerCm3{1.9}), 300.0, 1e-9);
}

TEST(Reaming, InverseUndoesForwardAndEdgesPlough) {
  const ReamingParams reamer;
  const FeedLaw law = reaming_law(reamer, kReamerSpeed, 600.0, kSubchondral);
  const FeedLaw cortical = reaming_law(reamer, kReamerSpeed, 1000.0, GramsPerCm3{1.9});
  for (const double v : {0.05, 0.5, 3.0}) EXPECT_NEAR(feed_at_mm_per_s(law, resistance_n(law, v)), v, 1e-9);
  EXPECT_EQ(feed_at_mm_per_s(cortical, 9.9), 0.0);
  EXPECT_GT(feed_at_mm_per_s(cortical, 10.1), 0.0);
}

TEST(Reaming, FasterTurningAndMoreTeethNeedLessEdgesAndWearMore) {
  const ReamingParams reamer{.edge_n_per_mm = 0.0};
  const double at = thrust(reamer, 0.5, 600.0, kSubchondral);
  EXPECT_NEAR(thrust(reamer, 0.5, 600.0, kSubchondral, RevolutionsPerMinute{500}), 0.5 * at, 1e-9);
  EXPECT_NEAR(thrust({.teeth = 80, .edge_n_per_mm = 0.0}, 0.5, 600.0, kSubchondral), 0.5 * at, 1e-9);
  EXPECT_NEAR(thrust(reamer, 0.5, 1200.0, kSubchondral), 2.0 * at, 1e-9);
  EXPECT_NEAR(thrust({.edge_n_per_mm = 0.0, .wear = 2.0}, 0.5, 600.0, kSubchondral), 2.0 * at, 1e-9);
}

// All the tangential force acts at one distance: M = (K_t t + k_e) L r.
TEST(Reaming, TorqueIsTheTangentialForceAtItsArm) {
  const ReamingParams reamer{.teeth = 40};
  const double edge = 1000.0, t = 60.0 * 0.5 / (250.0 * 40.0);
  const Newtons along{thrust(reamer, 0.5, edge, GramsPerCm3{1.9})};
  EXPECT_NEAR(reaming_torque(reamer, along, edge, GramsPerCm3{1.9}, 12.5).value(), (200.0 * t + 0.01) * edge * 12.5,
              1e-6);
}

// E = efficiency J^2 / (2 m): 0.7 · 2.8^2 / 1.4 = 3.92 J against 130 (0.3/1.9)^2 · 400 mm2.
TEST(Broaching, ABlowSpendsItsEnergyOnTheResistance) {
  const GramsPerCm3 density{0.3};
  const double resistance = broaching_resistance({}, 400.0, density).value();
  EXPECT_NEAR(resistance, 130.0 * (0.3 / 1.9) * (0.3 / 1.9) * 400.0, 1e-9);
  EXPECT_NEAR(blow_advance_mm({}, 400.0, density) * resistance, 3920.0, 1e-6);
}

TEST(Broaching, TwiceTheImpulseIsFourTimesTheWay) {
  const GramsPerCm3 density{0.4};
  const double at = blow_advance_mm({.impulse_n_s = 1.4}, 500.0, density);
  ASSERT_GT(at, 0.0);
  EXPECT_NEAR(blow_advance_mm({.impulse_n_s = 2.8}, 500.0, density), 4.0 * at, 1e-9);
  EXPECT_NEAR(blow_advance_mm({.impulse_n_s = 2.8, .wear = 2.0}, 500.0, density), 2.0 * at, 1e-9);
}

TEST(Broaching, IsSeatedWhereABlowDoesNextToNothing) {
  // 3920 N mm / 0.1 mm = 39.2 kN at 1.9 g/cm3: 301.5 mm2.
  EXPECT_GT(blow_advance_mm({}, 301.0, GramsPerCm3{1.9}), 0.0);
  EXPECT_EQ(blow_advance_mm({}, 302.0, GramsPerCm3{1.9}), 0.0);
  EXPECT_EQ(broaching_law({}, RevolutionsPerMinute{60}, 302.0, GramsPerCm3{1.9}).max_feed_mm_per_s, 0.0);
}

TEST(Broaching, BlowsAMinuteAreItsFeed) {
  const GramsPerCm3 density{0.3};
  const FeedLaw law = broaching_law({}, RevolutionsPerMinute{90}, 400.0, density);
  EXPECT_NEAR(law.max_feed_mm_per_s, 1.5 * blow_advance_mm({}, 400.0, density), 1e-9);
  // When held with 5 N, every blow counts.
  EXPECT_NEAR(resistance_n(law, law.max_feed_mm_per_s), 5.0, 1e-9);
  EXPECT_EQ(blow_advance_mm({}, 0.0, density), 5.0);  // nothing in the way
}

}  // namespace
}  // namespace osteon
