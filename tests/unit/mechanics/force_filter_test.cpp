#include "common/mechanics/force_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/geometry/pose.hpp"

namespace osteon {
namespace {

// (7.15) with alpha = exp(-dt/tau): a step is followed as 1 - exp(-t/tau), whatever the tick is.
TEST(ForceFilter, FollowsAStepIndependentlyOfTheTick) {
  for (const double dt : {5e-4, 1e-3, 2e-3}) {
    ForceFilter<double> filter(0.0);
    const int ticks = static_cast<int>(std::lround(0.01 / dt));
    for (int i = 0; i < ticks; ++i) filter.step(10.0, dt);
    EXPECT_NEAR(filter.value(), 10.0 * (1.0 - std::exp(-0.01 / 0.002)), 1e-9) << dt;
  }
}

TEST(ForceFilter, IsTheEquationAsPrinted) {
  ForceFilter<double> filter(3.0);
  const double alpha = std::exp(-0.5);  // 1 ms of 2 ms
  EXPECT_NEAR(filter.step(7.0, 1e-3), 7.0 * (1.0 - alpha) + 3.0 * alpha, 1e-12);
}

TEST(ForceFilter, KeepsAConstantAndNeverOvershoots) {
  ForceFilter<Vec3> filter(Vec3(1, -2, 3));
  EXPECT_NEAR((filter.step(Vec3(1, -2, 3), 1e-3) - Vec3(1, -2, 3)).norm(), 0.0, 1e-15);
  ForceFilter<double> one(0.0);
  double largest = 0.0;
  for (int i = 0; i < 1000; ++i) largest = std::max(largest, std::abs(one.step(i % 7 < 3 ? 5.0 : -5.0, 1e-3)));
  EXPECT_LE(largest, 5.0);
}

// A sine of 1 kHz / 20: gain of the recursion (1 - a) / |1 - a e^-iw|.
TEST(ForceFilter, DampsASineAsItsTransferFunctionSays) {
  ForceFilter<double> filter(0.0);
  const double w = 2.0 * std::numbers::pi / 20.0, alpha = std::exp(-0.5);
  double largest = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double out = filter.step(std::sin(w * i), 1e-3);
    if (i > 200) largest = std::max(largest, out);
  }
  const double gain = (1.0 - alpha) / std::sqrt(1.0 - 2.0 * alpha * std::cos(w) + alpha * alpha);
  EXPECT_NEAR(largest, gain, 0.02 * gain);
}

TEST(ForceFilter, ASafetyZeroIsAtOnce) {
  ForceFilter<double> filter(8.0);
  filter.reset(0.0);
  EXPECT_EQ(filter.step(0.0, 1e-3), 0.0);
}

}  // namespace
}  // namespace osteon
