// Angles, distances and depths from closed forms.
#include "common/tools/plan_offset.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace osteon {
namespace {

constexpr double kRad = std::numbers::pi / 180.0;
constexpr double kExact = 1e-9;

Annotation axis(const Vec3& entry_mm, const Vec3& target_mm) {
  return {.kind = AnnotationKind::axis, .points = {in_steps(entry_mm), in_steps(target_mm)}};
}

TEST(PlanOffset, OfAToolThatStandsAsPlannedIsTheWayToTheTarget) {
  const PlanOffset offset = plan_offset(axis({1, 2, 3}, {1, 2, -27}), pose_along({1, 2, 3}, {0, 0, -1}));
  EXPECT_NEAR(offset.angle_deg, 0.0, kExact);
  EXPECT_NEAR(offset.beside_mm, 0.0, kExact);
  EXPECT_NEAR(offset.depth_left_mm.value(), 30.0, kExact);
}

TEST(PlanOffset, SeesTurnsShiftsAndDepthsApart) {
  const Annotation planned = axis({0, 0, 0}, {0, 0, -20});
  // Tilted by 12 degrees, 3 mm and 4 mm beside the line, 5 mm above the entry.
  const Vec3 tilted(std::sin(12 * kRad), 0, -std::cos(12 * kRad));
  const PlanOffset offset = plan_offset(planned, pose_along({3, -4, 5}, tilted));
  EXPECT_NEAR(offset.angle_deg, 12.0, kExact);
  EXPECT_NEAR(offset.beside_mm, 5.0, kExact);
  EXPECT_NEAR(offset.depth_left_mm.value(), 25.0, kExact);
  // Beyond the target, and from the wrong side.
  EXPECT_NEAR(plan_offset(planned, pose_along({0, 0, -21.5}, {0, 0, -1})).depth_left_mm.value(), -1.5, kExact);
  EXPECT_NEAR(plan_offset(planned, pose_along({0, 0, -21.5}, {0, 0, 1})).angle_deg, 180.0, kExact);
  // A small angle keeps its digits.
  const Pose nearly{Vec3::Zero(), Eigen::Quaterniond(Eigen::AngleAxisd((180.0 - 1e-4) * kRad, Vec3::UnitY()))};
  EXPECT_NEAR(plan_offset(planned, nearly).angle_deg, 1e-4, kExact);
}

// The axis through (1, 0, 0) along (1, 1, 1): the point (0, 0, 0) is sqrt(2/3) beside it, 1/sqrt(3) before its foot.
TEST(PlanOffset, OfAnObliqueAxisIsThatOfItsFoot) {
  const PlanOffset offset = plan_offset(axis({1, 0, 0}, {4, 3, 3}), pose_along({0, 0, 0}, {1, 0, 0}));
  EXPECT_NEAR(offset.angle_deg, std::acos(1.0 / std::sqrt(3.0)) / kRad, kExact);
  EXPECT_NEAR(offset.beside_mm, std::sqrt(2.0 / 3.0), kExact);
  EXPECT_NEAR(offset.depth_left_mm.value(), 10.0 / std::sqrt(3.0), kExact) << "(4 + 3 + 3) / sqrt(3)";
}

TEST(PlanOffset, OfABladeIsItsTurnFromThePlaneAndTheWayOfItsTip) {
  // The plane z = 5, seen with its normal upwards.
  const Annotation plane{.kind = AnnotationKind::plane,
                         .points = {in_steps({0, 0, 5}), in_steps({10, 0, 5}), in_steps({0, 10, 5})}};
  // A blade along x whose thickness is along z, turned about x by 7 degrees.
  for (const double turn_deg : {7.0, -7.0, 187.0}) {
    Pose blade{{40, 30, 3.5}, {}};
    blade.rotation = Eigen::AngleAxisd(turn_deg * kRad, Vec3::UnitX()) *
                     Eigen::Quaterniond((Eigen::Matrix3d() << 0, 0, 1, 1, 0, 0, 0, 1, 0).finished());
    ASSERT_NEAR((blade.direction(Vec3::UnitZ()) - Vec3::UnitX()).norm(), 0.0, kExact);
    const PlanOffset offset = plan_offset(plane, blade);
    EXPECT_NEAR(offset.angle_deg, 7.0, kExact) << turn_deg << ": the sides of a blade are alike";
    EXPECT_NEAR(offset.beside_mm, -1.5, kExact);
    EXPECT_FALSE(offset.depth_left_mm);
  }
}

TEST(PlanOffset, APlaneSuitsSawsAndAnAxisTheOthers) {
  EXPECT_TRUE(suits(AnnotationKind::plane, ToolKind::oscillating_saw));
  EXPECT_TRUE(suits(AnnotationKind::plane, ToolKind::reciprocating_saw));
  EXPECT_FALSE(suits(AnnotationKind::axis, ToolKind::oscillating_saw));
  EXPECT_TRUE(suits(AnnotationKind::axis, ToolKind::drill));
  EXPECT_FALSE(suits(AnnotationKind::plane, ToolKind::round_burr));
  EXPECT_FALSE(suits(AnnotationKind::line, ToolKind::drill)) << "a line that somebody has drawn is no plan";
}

}  // namespace
}  // namespace osteon
