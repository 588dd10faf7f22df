#include "common/phantoms/implicit_shapes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/scenes/random.hpp"

namespace osteon::phantoms {
namespace {

TEST(SmoothMin, IsTheSmallerOneBeyondItsReach) {
  EXPECT_EQ(smooth_min(1.0, 4.0, 3.0), 1.0);
  EXPECT_EQ(smooth_min(-2.0, -9.0, 5.0), -9.0);
  EXPECT_NEAR(smooth_min(2.0, 2.0, 4.0), 1.0, 1e-12);  // a quarter of the blend lower
  EXPECT_EQ(smooth_max(1.0, 4.0, 3.0), 4.0);
}

TEST(SmoothMin, NeverRisesFasterThanItsParts) {
  test::Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const double a = random.between(-5, 5), b = random.between(-5, 5), k = random.between(0.5, 6), step = 1e-4;
    const double rise = (smooth_min(a + step, b + step, k) - smooth_min(a, b, k)) / step;
    EXPECT_NEAR(rise, 1.0, 1e-6);
    EXPECT_LE(smooth_min(a, b, k), std::min(a, b));
    EXPECT_EQ(smooth_min(a, b, k), smooth_min(b, a, k));
  }
}

// Another way: the smallest distance to any of the balls between both ends.
TEST(RoundCone, IsTheHullOfItsBalls) {
  test::Random random(5);
  const Vec3 a(1, -2, 3), b(6, 4, -2);
  const double ra = 4.0, rb = 2.0;
  for (int i = 0; i < 300; ++i) {
    const Vec3 at = a + random.in_cube(12.0);
    double nearest = 1e9;
    for (int step = 0; step <= 4000; ++step) {
      const double t = step / 4000.0;
      nearest = std::min(nearest, (at - a - t * (b - a)).norm() - ra - t * (rb - ra));
    }
    EXPECT_NEAR(round_cone_mm(at, a, ra, b, rb), nearest, 1e-3) << at.transpose();
  }
}

TEST(Ellipse, IsExactOnItsAxesAndForCircles) {
  for (const double depth : {-3.0, 0.0, 2.5, 7.0}) {
    EXPECT_NEAR(ellipse_mm(14.0 - depth, 0.0, 14.0, 16.0), -depth, 1e-12);
    EXPECT_NEAR(ellipse_mm(0.0, depth - 16.0, 14.0, 16.0), -depth, 1e-12);
    EXPECT_NEAR(ellipse_mm((15.0 - depth) * 0.6, (15.0 - depth) * 0.8, 15.0, 15.0), -depth, 1e-12);
  }
}

TEST(Profile, GoesThroughItsPointsAndNeverOvershoots) {
  const Profile profile({{0, 1}, {2, 5}, {3, 5}, {7, 2}, {8, -1}});
  EXPECT_EQ(profile(-4), 1.0);
  EXPECT_EQ(profile(9), -1.0);
  const std::vector<Profile::Point> points{{0, 1}, {2, 5}, {3, 5}, {7, 2}, {8, -1}};
  for (const auto& [x, y] : points) EXPECT_NEAR(profile(x), y, 1e-12);
  double last = profile(0);
  for (double x = 0.0; x <= 8.0; x += 0.01) {
    const double y = profile(x);
    EXPECT_GE(y, x <= 3.0 ? last - 1e-12 : -1.0);
    EXPECT_LE(y, x >= 2.015 ? last + 1e-12 : 5.0);
    last = y;
  }
}

TEST(Profile, IsExactForALine) {
  const Profile profile({{0, 0}, {1, 2}, {4, 8}, {5, 10}});
  for (double x = 1.0; x <= 4.0; x += 0.1) EXPECT_NEAR(profile(x), 2.0 * x, 1e-9);
}

// Its deviation follows from that of its lattice and from the smooth weights, w = 3 t² - 2 t³ and 1 - w: the mean of
// w² + (1 - w)² over a cell is 26 / 35 along each axis, and that of the square of a number from -1 to 1 is 1 / 3.
TEST(GrainNoise, HasNoMeanAndAKnownDeviation) {
  test::Random random(9);
  double sum = 0.0, squares = 0.0;
  constexpr int kCount = 200000;
  for (int i = 0; i < kCount; ++i) {
    const double noise = grain_noise(random.in_cube(300.0), 1.5);
    EXPECT_LE(std::abs(noise), 1.0);
    sum += noise;
    squares += noise * noise;
  }
  EXPECT_NEAR(sum / kCount, 0.0, 0.005);
  EXPECT_NEAR(std::sqrt(squares / kCount), std::sqrt(std::pow(26.0 / 35.0, 3) / 3.0), 0.005);
}

TEST(GrainNoise, IsTheSameAndSmooth) {
  const Vec3 at(12.34, -5.6, 78.9);
  EXPECT_EQ(grain_noise(at, 1.5), grain_noise(at, 1.5));
  EXPECT_NEAR(grain_noise(at, 1.5), grain_noise(at + Vec3(1e-6, 0, 0), 1.5), 1e-5);
}

}  // namespace
}  // namespace osteon::phantoms
