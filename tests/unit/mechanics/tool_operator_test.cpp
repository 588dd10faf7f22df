#include "common/mechanics/simulated_hand.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace osteon {
namespace {

constexpr double kLoop_s = 1e-3;

// Against a wall that takes exactly the push, nothing moves and the spring is not stretched.
TEST(Hand, PushesWithItsPush) {
  Hand hand(expert_hand(), Vec3::Zero());
  HandCommand push{HandMode::push, Vec3::Zero(), Vec3::UnitX()};
  double force = 0.0;
  for (int i = 0; i < 4000; ++i) {
    force = 50.0 * hand.position_mm().x();  // a wall of 50 N/mm
    hand.step(push, {-force, 0, 0}, kLoop_s);
  }
  EXPECT_NEAR(force, 29.0, 0.05);
}

// A frozen hand whose load vanishes: plunge = F/K (1 + overshoot), as the reaction time is long for its spring.
TEST(Hand, PlungesByPushOverStiffness) {
  for (const HandParams& params : {expert_hand(), novice_hand()}) {
    Hand hand(params, Vec3::Zero());
    const HandCommand push{HandMode::push, Vec3::Zero(), Vec3::UnitX()},
        release{HandMode::release, Vec3::Zero(), Vec3::UnitX()};
    for (int i = 0; i < 4000; ++i) hand.step(push, {-50.0 * hand.position_mm().x(), 0, 0}, kLoop_s);
    const double start = hand.position_mm().x();
    double furthest = start;
    for (int i = 0; i < 1500; ++i) {
      hand.step(release, Vec3::Zero(), kLoop_s);
      furthest = std::max(furthest, hand.position_mm().x());
    }
    EXPECT_NEAR(furthest - start, params.push_n / params.stiffness_n_per_mm,
                0.08 * params.push_n / params.stiffness_n_per_mm);
    // It comes back to where it was frozen.
    EXPECT_NEAR(hand.position_mm().x(), start, 0.1);
  }
}

// A step of the rest position is followed as in the damped oscillator's closed form: here critically damped.
TEST(Hand, CarriesAsACriticallyDampedOscillator) {
  HandParams params = expert_hand();
  const double mass = 1e-3 * params.mass_kg, omega = std::sqrt(params.stiffness_n_per_mm / mass);
  params.damping_n_s_per_mm = 2.0 * std::sqrt(params.stiffness_n_per_mm * mass);
  Hand hand(params, Vec3::Zero());
  for (int i = 1; i <= 100; ++i) {
    hand.step({HandMode::carry, {10, 0, 0}, Vec3::UnitX()}, Vec3::Zero(), kLoop_s);
    const double t = i * kLoop_s;
    EXPECT_NEAR(hand.position_mm().x(), 10.0 * (1.0 - (1.0 + omega * t) * std::exp(-omega * t)), 0.1);
  }
}

TEST(Hand, ScalingForcesKeepsMotion) {
  const double s = 0.03;
  Hand full(expert_hand(), Vec3::Zero()), light(scaled(expert_hand(), s), Vec3::Zero());
  for (int i = 0; i < 500; ++i) {
    const HandCommand command{HandMode::push, Vec3::Zero(), Vec3::UnitX()};
    const double load = 20.0 * full.position_mm().x();
    full.step(command, {-load, 0.5, 0}, kLoop_s);
    light.step(command, {-s * load, s * 0.5, 0}, kLoop_s);
  }
  EXPECT_NEAR((full.position_mm() - light.position_mm()).norm(), 0.0, 1e-9);
  EXPECT_GT(full.position_mm().x(), 0.5);
}

TEST(Hand, ARigGoesExactlyToItsTarget) {
  Hand hand(expert_hand(), Vec3::Zero());
  hand.step({HandMode::rig, {1, 2, 3}, Vec3::UnitX()}, {-1000, 0, 0}, kLoop_s);
  EXPECT_EQ(hand.position_mm(), Vec3(1, 2, 3));
}

}  // namespace
}  // namespace osteon
