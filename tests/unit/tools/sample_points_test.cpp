#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/tools/spread_points.hpp"
#include "common/tools/tool.hpp"
#include "common/tools/tool_solid.hpp"
#include "common/tools/tool_surface.hpp"

namespace osteon {
namespace {

using std::numbers::pi;

double area_of(const std::vector<SamplePoint>& points) {
  double sum = 0.0;
  for (const SamplePoint& point : points) sum += point.area_mm2;
  return sum;
}

TEST(SamplePoints, LieOnTheToolWithTheirNormalsInwards) {
  for (const Tool& tool : builtin_tools())
    for (const SamplePoint& point : sample_points(tool, 100)) {
      ASSERT_NEAR(signed_distance_mm(tool, point.position_mm), 0.0, 1e-9) << tool.name;
      ASSERT_NEAR(point.inward.norm(), 1.0, 1e-12) << tool.name;
      ASSERT_LT(signed_distance_mm(tool, point.position_mm + 0.05 * point.inward), -0.02) << tool.name;
      ASSERT_GT(point.area_mm2, 0.0) << tool.name;
    }
}

TEST(SamplePoints, AreAsManyAsAskedOnThePartThatCuts) {
  for (const Tool& tool : builtin_tools())
    for (const int wanted : {1, 50, 300}) {
      const auto points = sample_points(tool, wanted);
      const auto active = std::ranges::count_if(points, &SamplePoint::active);
      if (tool.cuts()) {
        EXPECT_GE(active, wanted) << tool.name;
      } else {
        EXPECT_GE(points.size(), static_cast<std::size_t>(wanted)) << tool.name;
      }
      if (!tool.cuts()) {
        EXPECT_EQ(active, 0) << tool.name;
      }
      // Not many more than asked for. Otherwise the count would be meaningless.
      if (wanted == 300) {
        EXPECT_LE(tool.cuts() ? active : static_cast<std::ptrdiff_t>(points.size()), 450) << tool.name;
      }
    }
}

TEST(SamplePoints, AreActiveOnTheCuttingPartOnly) {
  for (const Tool& tool : builtin_tools()) {
    if (!tool.cuts()) continue;
    const Implicit part = cutting_part(tool);
    int passive = 0;
    for (const SamplePoint& point : sample_points(tool, 100)) {
      if (point.active) {
        ASSERT_NEAR(part(point.position_mm), 0.0, 1e-9) << tool.name;
      }
      if (point.position_mm.z() < -tool.cutting_length_mm - 0.01) {
        ASSERT_FALSE(point.active) << tool.name;
      }
      passive += !point.active;
    }
    EXPECT_GT(passive, 5) << tool.name;
  }
}

TEST(SamplePoints, AreTheSameEveryTime) {
  for (const char* name : {"saw-oscillating-1", "screw-1", "reamer-outside"}) {
    const auto a = sample_points(*find_tool(name), 120), b = sample_points(*find_tool(name), 120);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_EQ(a[i].position_mm, b[i].position_mm);
  }
}

TEST(SamplePoints, StandForTheWholeCuttingFace) {
  const Tool drill = *find_tool("drill-3.2");
  double face = 0.0;
  for (const SamplePoint& point : sample_points(drill, 200))
    if (point.active) face += point.area_mm2;
  // Lateral area of the cone: π R times its slant, R / sin(59°).
  EXPECT_NEAR(face, pi * 1.6 * 1.6 / std::sin(59.0 * pi / 180.0), 1e-6);

  const Tool burr = *find_tool("burr-round-5");
  double forward = 0.0;
  for (const SamplePoint& point : sample_points(burr, 200))
    forward += point.active ? point.area_mm2 * std::max(0.0, -point.inward.z()) : 0.0;
  // Along the axis a sphere appears as a disc.
  EXPECT_NEAR(forward, pi * 2.5 * 2.5, 0.02 * pi * 2.5 * 2.5);

  // A hemisphere of 50 mm.
  double dome = 0.0;
  for (const SamplePoint& point : sample_points(*find_tool("reamer-sphere"), 200))
    dome += point.active ? point.area_mm2 : 0.0;
  EXPECT_NEAR(dome, 2.0 * pi * 25.0 * 25.0, 0.02 * 2.0 * pi * 25.0 * 25.0);
  // A flat disc of 9.5 mm.
  double end = 0.0;
  for (const SamplePoint& point : sample_points(*find_tool("end-drill"), 200))
    end += point.active ? point.area_mm2 : 0.0;
  EXPECT_NEAR(end, pi * 4.75 * 4.75, 0.02 * pi * 4.75 * 4.75);
}

// Two roads to the same points: on the whole surface, and on that of the cutting part alone.
TEST(SamplePoints, OfTheCuttingPartAloneAreThoseOfTheWholeTool) {
  for (const char* name :
       {"saw-oscillating-3", "saw-reciprocating", "end-drill", "screw-1", "broach-2", "reamer-outside", "drill-3.2"}) {
    SCOPED_TRACE(name);
    const Tool tool = *find_tool(name);
    std::vector<SamplePoint> expected = sample_points(tool, 200);
    std::erase_if(expected, [](const SamplePoint& point) { return !point.active; });
    const std::vector<SamplePoint> points = active_points(tool, 200);
    ASSERT_EQ(points.size(), expected.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(points[i].position_mm, expected[i].position_mm);
      EXPECT_EQ(points[i].inward, expected[i].inward);
      EXPECT_EQ(points[i].area_mm2, expected[i].area_mm2);
      EXPECT_TRUE(points[i].active);
    }
  }
}

const auto everywhere = [](const Vec3&, const Vec3&) { return true; };

TEST(SpreadPoints, AreasAddUpToTheSurfaceOfSphereCylinderAndBox) {
  const struct {
    Implicit solid;
    double area_mm2;
  } cases[] = {
      {ball({1, 2, 3}, 4.0), 4.0 * pi * 16.0},
      {cylinder(2.0, -7.0, 3.0), 2.0 * pi * 2.0 * 10.0 + 2.0 * pi * 4.0},
      {cuboid({Vec3(-1, -2, -3), Vec3(4, 3, 5)}), 2.0 * (25.0 + 40.0 + 40.0)},
  };
  for (const auto& c : cases) {
    const auto points = spread_points(c.solid, surface_of(c.solid, 0.4), everywhere, {.count = 200});
    EXPECT_NEAR(area_of(points), c.area_mm2, 0.01 * c.area_mm2);
    // By divergence: over a closed surface, areas times normals sum to zero, and times positions to the volume.
    Vec3 net = Vec3::Zero();
    for (const SamplePoint& point : points) net += point.area_mm2 * point.inward;
    EXPECT_LT(net.norm(), 0.04 * c.area_mm2);
  }
}

// Blue noise: with N points on area A, equal circles in the densest packing would be r = sqrt(2 A / (sqrt(3) N)) apart.
TEST(SpreadPoints, AreNowhereTooNearAndLeaveNoBarePatch) {
  for (const int count : {60, 240, 1000}) {
    const Implicit solid = ball({0, 0, 0}, 3.0);
    const auto points = spread_points(solid, surface_of(solid, 0.3), everywhere, {.count = count});
    const double packed = std::sqrt(2.0 / std::sqrt(3.0) * 4.0 * pi * 9.0 / static_cast<double>(points.size()));
    double closest = 1e9;
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        closest = std::min(closest, (points[i].position_mm - points[j].position_mm).norm());
    EXPECT_GT(closest, 0.6 * packed) << count;
    // Random points of the same count would have a closest pair at 0.05 of it. Bare patches are measured over the
    // positions of a golden spiral, which do not depend on the points.
    double barest = 0.0;
    for (int i = 0; i < 5000; ++i) {
      const double z = 1.0 - (2.0 * i + 1.0) / 5000.0, angle = i * pi * (3.0 - std::sqrt(5.0)),
                   r = std::sqrt(1.0 - z * z);
      const Vec3 p = 3.0 * Vec3(r * std::cos(angle), r * std::sin(angle), z);
      double nearest = 1e9;
      for (const SamplePoint& point : points) nearest = std::min(nearest, (p - point.position_mm).norm());
      barest = std::max(barest, nearest);
    }
    EXPECT_LT(barest, 1.05 * packed) << count;
    // Each point stands for its own patch.
    for (const SamplePoint& point : points) {
      EXPECT_GT(point.area_mm2, 0.2 * area_of(points) / static_cast<double>(points.size()));
      EXPECT_LT(point.area_mm2, 2.5 * area_of(points) / static_cast<double>(points.size()));
    }
  }
}

TEST(SpreadPoints, BothSidesOfAThinPlateAreCovered) {
  const Implicit plate = cuboid({Vec3(-10, -0.2, -20), Vec3(10, 0.2, 0)});
  const auto points = spread_points(plate, surface_of(plate, 0.19), everywhere, {.count = 120});
  const auto front = std::ranges::count_if(points, [](const SamplePoint& p) { return p.inward.y() > 0.9; });
  const auto back = std::ranges::count_if(points, [](const SamplePoint& p) { return p.inward.y() < -0.9; });
  EXPECT_GT(front, 40);
  EXPECT_GT(back, 40);
}

}  // namespace
}  // namespace osteon
