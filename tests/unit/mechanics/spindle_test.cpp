// The spindle under load: closed forms of a motor with a straight line of speed over torque, a largest torque, and
// inertia.
#include "common/mechanics/spindle.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace osteon {
namespace {

constexpr double kTick_s = 1e-3;
constexpr SpindleParams kMotor{
    .full_rpm = 1000, .run_up_s = 0.3, .droop_rpm_per_nmm = 0.2, .most_nmm = 400, .response_s = 0.02};

void run(Spindle& spindle, double command_rpm, double torque_nmm, double seconds, double dt_s = kTick_s) {
  for (int i = 0; i < static_cast<int>(std::lround(seconds / dt_s)); ++i)
    spindle.step(kMotor, command_rpm, torque_nmm, dt_s);
}

TEST(Spindle, RunsUpAndDownInItsTime) {
  Spindle spindle;
  run(spindle, 1000, 0, 0.15);
  EXPECT_NEAR(spindle.rpm, 500.0, 5.0);
  run(spindle, 1000, 0, 0.2);
  EXPECT_EQ(spindle.rpm, 1000.0);
  run(spindle, 0, 0, 0.31);
  EXPECT_EQ(spindle.rpm, 0.0);
  EXPECT_FALSE(spindle.stalled);
}

// A load that the motor can carry: the speed goes exponentially to its value less droop times torque.
TEST(Spindle, DroopsUnderLoad) {
  for (const double dt : {5e-4, 1e-3, 2e-3}) {
    Spindle spindle;
    run(spindle, 1000, 0, 0.4, dt);
    run(spindle, 1000, 27.0, 0.02, dt);
    EXPECT_NEAR(spindle.rpm, 1000.0 - 27.0 * 0.2 * (1.0 - std::exp(-1.0)), 1e-6) << dt;
    run(spindle, 1000, 27.0, 0.4, dt);
    EXPECT_NEAR(spindle.rpm, 994.6, 1e-4) << dt;
    run(spindle, 1000, 0.0, 0.4, dt);
    EXPECT_NEAR(spindle.rpm, 1000.0, 1e-4) << dt;
  }
}

// A load beyond its torque: the excess slows the rotor at a constant rate, with inertia response / droop.
TEST(Spindle, StallsAndTurnsAgain) {
  Spindle spindle;
  run(spindle, 1000, 0, 0.4);
  run(spindle, 1000, 380.0, 1.0);
  EXPECT_NEAR(spindle.rpm, 1000.0 - 76.0, 0.1);
  run(spindle, 1000, 500.0, 0.05);
  EXPECT_NEAR(spindle.rpm, 1000.0 - 80.0 - 100.0 * 0.2 / 0.02 * 0.05, 6.0);
  EXPECT_FALSE(spindle.stalled);
  run(spindle, 1000, 500.0, 1.0);
  EXPECT_EQ(spindle.rpm, 0.0);
  EXPECT_TRUE(spindle.stalled);
  // It stands as long as it is held. When the load falls, it comes back as fast as its torque allows.
  run(spindle, 1000, 401.0, 1.0);
  EXPECT_TRUE(spindle.stalled);
  run(spindle, 1000, 300.0, 0.5);
  EXPECT_FALSE(spindle.stalled);
  EXPECT_NEAR(spindle.rpm, 100.0 * 0.2 / 0.02 * 0.5, 5.0);
  run(spindle, 1000, 0.0, 0.8);
  EXPECT_NEAR(spindle.rpm, 1000.0, 0.1);
}

}  // namespace
}  // namespace osteon
