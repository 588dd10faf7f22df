#include "common/tools/implicit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/tools/tool_file.hpp"
#include "common/tools/tool_solid.hpp"

namespace osteon {
namespace {

// The distance to a box made of six half-spaces equals its closed form.
TEST(Implicit, AConvexSolidFromHalfSpacesIsAsExactAsABox) {
  const Box box{Vec3(-1, -2, -3), Vec3(2, 1, 0.5)};
  std::vector<HalfSpace> faces;
  for (int k = 0; k < 3; ++k) {
    faces.push_back({Vec3::Unit(k), box.max_mm[k]});
    faces.push_back({-Vec3::Unit(k), -box.min_mm[k]});
  }
  const Implicit hull = convex(faces), plain = cuboid(box);
  EXPECT_TRUE(hull.bounds.min_mm.isApprox(box.min_mm));
  EXPECT_TRUE(hull.bounds.max_mm.isApprox(box.max_mm));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-6, 6);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p(place(random), place(random), place(random));
    const Vec3 q = p.cwiseMax(box.min_mm).cwiseMin(box.max_mm);
    ASSERT_NEAR(hull(p), plain(p), 1e-12);
    if ((p - q).norm() > 0.0) {
      ASSERT_NEAR(plain(p), (p - q).norm(), 1e-12);
    }
  }
}

// A revolved rectangle is a cylinder, and a revolved outline off the axis is a tube.
TEST(Implicit, ATurnedOutlineIsTheSolidThatItGoesRound) {
  const Implicit solid = turned({{0, -4}, {2, -4}, {2, 1}, {0, 1}}), plain = cylinder(2, -4, 1);
  const Implicit ring = turned({{1, -4}, {2, -4}, {2, 1}, {1, 1}}), tube = subtract(plain, cylinder(1, -9, 9));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-6, 6);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p(place(random), place(random), place(random));
    ASSERT_NEAR(solid(p), plain(p), 1e-12);
    // It is exact, so it is never below the bound that a difference gives, and has the same sign.
    ASSERT_GE(ring(p), tube(p) - 1e-12);
    ASSERT_EQ(ring(p) < 0.0, tube(p) < 0.0);
  }
}

// Figure 6.2 of the dissertation: half a sphere is the intersection of a sphere and a half-space.
TEST(Implicit, BooleanOperationsJoinInsideAndOutside) {
  const Implicit sphere = ball({0, 0, 0}, 2), half = intersect(sphere, cuboid({Vec3(-3, -3, 0), Vec3(3, 3, 3)}));
  EXPECT_LT(half({0, 0, 1}), 0.0);
  EXPECT_GT(half({0, 0, -1}), 0.0);
  EXPECT_GT(half({0, 0, 2.1}), 0.0);
  EXPECT_LT(unite(sphere, half)({0, 0, -1}), 0.0);
  EXPECT_GT(subtract(sphere, half)({0, 0, 1}), 0.0);
  const Pose pose = pose_along({1, 2, 3}, {1, 1, 0});
  EXPECT_NEAR(placed(half, pose)(pose.point({0, 0, 1})), half({0, 0, 1}), 1e-12);
}

class EveryTool : public testing::TestWithParam<Tool> {};

TEST_P(EveryTool, DistanceChangesAtMostAsFastAsThePointMoves) {
  const Implicit solid = tool_solid(GetParam());
  std::mt19937 random(3);
  const Box box = solid.bounds.grown(3.0);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::normal_distribution<double> step(0.0, 1.0);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 a = box.min_mm + Vec3(share(random), share(random), share(random)).cwiseProduct(box.size_mm());
    // From a hundredth of a millimetre to several millimetres.
    const Vec3 b = a + std::pow(10.0, 3.0 * share(random) - 2.0) * Vec3(step(random), step(random), step(random));
    ASSERT_LE(std::abs(solid(a) - solid(b)), (a - b).norm() * (1.0 + 1e-12) + 1e-12);
  }
}

// Central differences with another step than the library's, wherever the distance has a gradient.
TEST_P(EveryTool, NormalIsTheDistancesSteepestWay) {
  const Tool& tool = GetParam();
  const Implicit solid = tool_solid(tool);
  int compared = 0;
  for (const SamplePoint& point : sample_points(tool, 100)) {
    const Vec3 p = point.position_mm - 0.02 * point.inward;
    if (solid(p) < 0.019) continue;  // another part is nearer, as in the root of a thread
    Vec3 slope;
    for (int k = 0; k < 3; ++k) slope[k] = (solid(p + 1e-3 * Vec3::Unit(k)) - solid(p - 1e-3 * Vec3::Unit(k))) / 2e-3;
    if (slope.norm() < 0.97) continue;  // by an edge
    ++compared;
    ASSERT_GT(normal(tool, p).dot(slope.normalized()), 0.9999);
    ASSERT_GT(normal(tool, p).dot(-point.inward), 0.99);
  }
  EXPECT_GT(compared, 50);
}

TEST_P(EveryTool, BoxesHoldTheToolTightly) {
  const Tool& tool = GetParam();
  const Box local = local_bounds(tool);
  const Pose pose{Vec3(5, -3, 2), Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized()};
  const Box world = world_bounds(tool, pose);
  const Implicit solid = tool_solid(tool);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const Box around = local.grown(2.0);
  int inside = 0;
  for (int i = 0; i < 50000; ++i) {
    const Vec3 p = around.min_mm + Vec3(share(random), share(random), share(random)).cwiseProduct(around.size_mm());
    if (solid(p) > 0.0) continue;
    ++inside;
    for (int k = 0; k < 3; ++k) {
      ASSERT_GE(p[k], local.min_mm[k] - 1e-9);
      ASSERT_LE(p[k], local.max_mm[k] + 1e-9);
      ASSERT_GE(pose.point(p)[k], world.min_mm[k] - 1e-9);
      ASSERT_LE(pose.point(p)[k], world.max_mm[k] + 1e-9);
    }
  }
  EXPECT_GT(inside, 20);
  // The box is tight: the tool touches every side. Just outside of a side the distance is small somewhere, and just
  // inside it is zero.
  for (int k = 0; k < 3; ++k)
    for (const bool top : {false, true}) {
      double nearest = 1e9;
      const double at = top ? local.max_mm[k] : local.min_mm[k];
      for (int i = 0; i <= 100; ++i)
        for (int j = 0; j <= 100; ++j) {
          Vec3 p = local.min_mm + Vec3(i, i, i).cwiseProduct(local.size_mm()) / 100.0;
          p[(k + 1) % 3] = local.min_mm[(k + 1) % 3] + j / 100.0 * local.size_mm()[(k + 1) % 3];
          p[k] = at;
          nearest = std::min(nearest, solid(p));
        }
      // The sampled positions are up to half a step of the box's sides beside the one that touches.
      const double step = std::hypot(local.size_mm()[(k + 1) % 3], local.size_mm()[(k + 2) % 3]) / 200.0;
      EXPECT_LE(nearest, step + 1e-9) << "side " << k << " " << top;
    }
}

INSTANTIATE_TEST_SUITE_P(Builtin, EveryTool, testing::ValuesIn(builtin_tools().begin(), builtin_tools().end()),
                         [](const auto& param) {
                           std::string name = param.param.name;
                           std::ranges::replace_if(
                               name, [](char c) { return !std::isalnum(c); }, '_');
                           return name;
                         });

}  // namespace
}  // namespace osteon
