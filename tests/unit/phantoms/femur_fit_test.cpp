// The fit of a femur's parameters to a surface, with a truth: points of a phantom. SharedScans of unit.import fits a
// real femur.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "common/phantoms/femur.hpp"
#include "tests/support/scenes/fitted_femur.hpp"

namespace osteon::phantoms {
namespace {

// A femur that differs from the start of the fit, turned and moved.
TEST(FemurFit, FindsAPhantomAgain) {
  const auto truth = femur_parameters({.kind = "femur",
                                       .side = Side::left,
                                       .preset = "female",
                                       .condition = "adult",
                                       .changes = {{"neck_shaft_degrees", 129.0}, {"bow_radius_mm", 800.0}}});
  ASSERT_TRUE(truth) << truth.error().message;
  const Femur bone(*truth, Side::left);
  Pose pose;
  pose.position_mm = {12.0, -30.0, 55.0};
  pose.rotation = Eigen::AngleAxisd(0.06, Vec3(0.3, -0.5, 0.8).normalized());
  std::vector<Vec3> points;
  for (const Vec3& p : test::points_on(bone, 1500)) points.push_back(pose.point(p));
  const test::FittedFemur found = test::fit_femur(points);
  const double mean_mm = test::distances_mm(found, points).cwiseAbs().mean();
  std::printf("[          ] mean distance %.3f mm; neck to shaft %.2f degrees, head %.2f mm, length %.2f mm\n", mean_mm,
              found.parameters.neck_shaft_degrees, found.parameters.head_diameter_mm, found.parameters.length_mm);
  EXPECT_LT(mean_mm, 0.01);
  EXPECT_NEAR(found.parameters.head_diameter_mm, truth->head_diameter_mm, 0.001 * truth->head_diameter_mm);
  EXPECT_NEAR(found.parameters.length_mm, truth->length_mm, 0.001 * truth->length_mm);
  EXPECT_NEAR(found.parameters.neck_shaft_degrees, truth->neck_shaft_degrees, 0.1);
}

// A section of the shaft beside the ellipse that the parameters say.
TEST(FemurFit, ASectionHasTheMomentsOfItsEllipse) {
  const FemurParameters p;
  const Femur bone(p, Side::left);
  const test::SectionMoments found = test::section_of(bone, test::shaft_plane(p, 0.55));
  const double a = 0.5 * p.width_55_mm, b = 0.5 * p.depth_55_mm, area = M_PI * a * b;
  EXPECT_NEAR(found.area, area, 0.01 * area);
  EXPECT_NEAR(found.xx, area * a * a / 4.0, 0.02 * area * a * a / 4.0);
  EXPECT_NEAR(found.yy, area * b * b / 4.0, 0.02 * area * b * b / 4.0);
}

}  // namespace
}  // namespace osteon::phantoms
