#include "common/geometry/triangle_distance.hpp"

#include <gtest/gtest.h>

#include <random>

#include "common/geometry/pose.hpp"

namespace osteon {
namespace {

// Least distance to points that lie densely on the triangle: an upper bound, at most half a step too large.
double by_sampling(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, int steps) {
  double least = 1e300;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; i + j <= steps; ++j)
      least = std::min(least, (p - (a + (b - a) * i / steps + (c - a) * j / steps)).norm());
  return least;
}

template <class Scalar>
double distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto s =
      distance_to_triangle<Scalar>(p.cast<Scalar>(), a.cast<Scalar>(), b.cast<Scalar>(), c.cast<Scalar>()).squared;
  return std::sqrt(static_cast<double>(s));
}

TEST(TriangleDistance, IsThatToTheNearestPointOfIt) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-2.0, 2.0);
  const auto point = [&] { return Vec3(place(random), place(random), place(random)); };
  for (int i = 0; i < 300; ++i) {
    const Vec3 p = point(), a = point(), b = point(), c = point();
    const double sampled = by_sampling(p, a, b, c, 200), step = std::max((b - a).norm(), (c - a).norm()) / 200;
    for (const double d : {distance<double>(p, a, b, c), distance<float>(p, a, b, c)}) {
      EXPECT_LE(d, sampled + 1e-5);
      EXPECT_GE(d, sampled - step);
    }
  }
}

TEST(SegmentDistance, IsThatOfThePointWhereBothEndsAreOne) {
  const Vec3 p(1, 2, 3), end(1, 0, 0);
  EXPECT_EQ(squared_distance_to_segment<double>(p, end, end), 13.0);
  EXPECT_EQ(squared_distance_to_segment<double>(p, end, Vec3(1, 9, 0)), 9.0);
}

// Two or all corners coincide, or the corners are in a line: triangles that come from a corner at a voxel on the
// threshold.
TEST(TriangleDistance, IsFiniteAndRightWithoutArea) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-2.0, 2.0);
  const auto point = [&] { return Vec3(place(random), place(random), place(random)); };
  for (int i = 0; i < 300; ++i) {
    const Vec3 p = point(), a = point(), b = point(), on_line = a + (b - a) * place(random);
    const std::array<std::array<Vec3, 3>, 7> triangles{
        {{a, a, b}, {a, b, a}, {b, a, a}, {a, a, a}, {a, b, on_line}, {on_line, a, b}, {a, on_line, b}}};
    for (const auto& [u, v, w] : triangles) {
      const double sampled = by_sampling(p, u, v, w, 400), step = std::max((v - u).norm(), (w - u).norm()) / 400;
      for (const double d : {distance<double>(p, u, v, w), distance<float>(p, u, v, w)}) {
        ASSERT_TRUE(std::isfinite(d));
        EXPECT_LE(d, sampled + 1e-3);
        EXPECT_GE(d, sampled - step - 1e-3);
      }
    }
  }
}

}  // namespace
}  // namespace osteon
