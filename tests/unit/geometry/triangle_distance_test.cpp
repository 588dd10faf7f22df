#include "common/geometry/triangle_distances.hpp"

#include <gtest/gtest.h>

#include <random>

#include "common/geometry/pose.hpp"
#include "common/geometry/triangle_distance.hpp"

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

// Places on a coarse grid, so that many triangles have no area, right angles, or the point on a side.
TEST(TriangleDistance, OfEightAtOnceHasTheSameBytes) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> step(-2, 2);
  std::uniform_real_distribution<float> jitter(-0.3f, 0.3f);
  for (int i = 0; i < 4000; ++i) {
    const auto point = [&] {
      const Eigen::Vector3f place = Eigen::Vector3i(step(random), step(random), step(random)).cast<float>();
      return i % 2 == 0 ? place : Eigen::Vector3f(place + Eigen::Vector3f(jitter(random), jitter(random), 0.0f));
    };
    std::array<std::array<Eigen::Vector3f, 8>, 4> of;  // p, a, b, c of each lane
    for (auto& corners : of)
      for (Eigen::Vector3f& lane : corners) lane = point();
    const auto all = [&](std::size_t n) {
      Points8 points;
      for (std::size_t lane = 0; lane < 8; ++lane) points.set(lane, of[n][lane]);
      return points;
    };
    const auto found = squared_distances_to_triangles(all(0), all(1), all(2), all(3));
    for (std::size_t lane = 0; lane < 8; ++lane)
      ASSERT_EQ(found[lane], distance_to_triangle<float>(of[0][lane], of[1][lane], of[2][lane], of[3][lane]).squared)
          << "trial " << i << ", lane " << lane;
  }
}

}  // namespace
}  // namespace osteon
