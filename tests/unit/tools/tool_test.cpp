#include "common/tools/tool.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace osteon {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(Tools, DrillsConeIsAsHighAsItsPointAngleSays) {
  const Tool drill = *find_tool("drill-3.2");
  // (D/2) / tan(59°), which force-laws call the ramp of the entry: 0.961 mm.
  EXPECT_NEAR(-drill.cut_body().profile[3].z * kQuantum_mm, 0.961, 0.001);
}

TEST(Tools, DistanceIsZeroOnEverySamplePointAndItsNormalPointsInward) {
  for (const Tool& tool : builtin_tools())
    for (const SamplePoint& point : sample_points(tool, 100)) {
      ASSERT_NEAR(signed_distance_mm(tool, point.position_mm), 0.0, 1e-9) << tool.name;
      ASSERT_NEAR(point.inward.norm(), 1.0, 1e-12) << tool.name;
      ASSERT_LT(signed_distance_mm(tool, point.position_mm + 0.05 * point.inward), -0.02) << tool.name;
    }
}

TEST(Tools, DistanceChangesAtMostAsFastAsThePointMoves) {
  for (const Tool& tool : builtin_tools()) {
    Vec3 previous{3.0, -2.0, 6.0};
    double before = signed_distance_mm(tool, previous);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 step = 0.2 * Vec3{std::sin(1.1 * i), std::cos(0.7 * i), std::sin(0.13 * i) - 0.2};
      const Vec3 next = previous + step;
      const double now = signed_distance_mm(tool, next);
      ASSERT_LE(std::abs(now - before), step.norm() + 1e-9) << tool.name;
      previous = next;
      before = now;
    }
  }
}

TEST(Tools, SamplePointsStandForTheWholeCuttingFace) {
  const Tool drill = *find_tool("drill-3.2");
  double face = 0.0;
  for (const SamplePoint& point : sample_points(drill, 200))
    if (point.active) face += point.area_mm2;
  // Lateral area of the cone: π R times its slant, R / sin(59°).
  EXPECT_NEAR(face, kPi * 1.6 * 1.6 / std::sin(59.0 * kPi / 180.0), 1e-6);

  const Tool burr = *find_tool("burr-round-5");
  double forward = 0.0;
  for (const SamplePoint& point : sample_points(burr, 200)) forward += point.active ? point.area_mm2 * std::max(0.0, -point.inward.z()) : 0.0;
  // Seen along the axis a sphere is a disc.
  EXPECT_NEAR(forward, kPi * 2.5 * 2.5, 0.02 * kPi * 2.5 * 2.5);
}

TEST(Tools, ManySamplePointsAreGivenWhereManyAreAsked) {
  for (const Tool& tool : builtin_tools())
    for (const int wanted : {1, 50, 1000}) {
      const auto points = sample_points(tool, wanted);
      EXPECT_GE(std::ranges::count_if(points, &SamplePoint::active), wanted) << tool.name;
    }
}

TEST(Tools, AnUnknownNameListsTheKnownOnes) {
  const auto tool = find_tool("drill-9");
  ASSERT_FALSE(tool);
  EXPECT_NE(tool.error().message.find("drill-9"), std::string::npos);
  EXPECT_NE(tool.error().message.find("drill-3.2"), std::string::npos);
}

TEST(Tools, EveryFieldIsPartOfTheHash) {
  const Tool drill = *find_tool("drill-3.2");
  Tool other = drill;
  other.spindle_rpm += 1.0;
  EXPECT_NE(drill.hash(), other.hash());
  EXPECT_EQ(drill.hash(), find_tool("drill-3.2")->hash());
}

}  // namespace
}  // namespace osteon
