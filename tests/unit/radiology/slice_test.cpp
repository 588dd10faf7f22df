// Slices: the field's own samples at the positions of samples, a closed form between them, air outside.
#include "common/radiology/slice.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/radiology/sampling.hpp"
#include "tests/support/scenes/random_cuts.hpp"
#include "tests/unit/radiology/reference_hu.hpp"

namespace osteon::radiology {
namespace {

std::vector<float> slice_of(const BoneHu& bone, const PixelGrid& plane) {
  std::vector<float> hu(plane.count());
  sample_slice(bone, plane, hu);
  return hu;
}

Case linear_bone() {
  return test::make_bone(
      {Vec3(-10, -10, -10), Vec3(10, 10, 10)}, 0.5, [](const Vec3& p) { return p.cwiseAbs().maxCoeff() - 10.0; },
      [](const Vec3& p) { return 1.0 + 0.02 * p.x() - 0.01 * p.y() + 0.03 * p.z(); });
}

BoneHu cut_ball(CutField& field) {
  test::Random random(11);
  for (const Cut& cut : test::grazing_cuts(200, random)) field.apply(cut);
  auto made = BoneHu::make(field.bone());
  EXPECT_TRUE(made.has_value());
  EXPECT_TRUE(made->renew(std::vector<const CutField*>{&field}).has_value());
  return std::move(*made);
}

TEST(Slice, EqualsTheFieldAtItsSamples) {
  CutField field(test::ball_of_bone(), {});
  const BoneHu bone = cut_ball(field);
  const double h = bone.pitch_mm();
  const Vec3 axes[3] = {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
  const Coord first{-25, -24, -23};
  const Coord steps[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int normal = 0; normal < 3; ++normal)
    for (const std::int32_t depth : {3, 17, 23, 40}) {
      const int u = (normal + 1) % 3, v = (normal + 2) % 3;
      const Coord corner = first + depth * steps[normal];
      const PixelGrid plane{position_mm(corner, h), h * axes[u], h * axes[v], 53, 47};
      const std::vector<float> hu = slice_of(bone, plane);
      for (int row = 0; row < plane.rows; ++row)
        for (int column = 0; column < plane.columns; ++column) {
          const Coord sample = corner + column * steps[u] + row * steps[v];
          const float found = hu[plane.index(column, row)];
          ASSERT_EQ(found, bone.hu(sample));
          // Against the field itself, for some of them: its definition takes long.
          if ((column + 3 * row) % 11 == 0) {
            ASSERT_NEAR(attenuation_per_mm(static_cast<double>(found)), reference_per_mm(field, sample), 5e-5);
          }
        }
    }
}

TEST(Slice, OfALinearFieldIsLinear) {
  const Case bone = linear_bone();
  const auto hu = BoneHu::make(bone);
  ASSERT_TRUE(hu.has_value());
  const Pose pose{Vec3(0.3, -0.2, 0.1), Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()))};
  const PixelGrid plane =
      grid_about(pose.position_mm, pose.direction(Vec3::UnitX()), pose.direction(Vec3::UnitY()), 0.17, 61, 43);
  const std::vector<float> values = slice_of(*hu, plane);
  std::size_t inside = 0;
  for (int row = 0; row < plane.rows; ++row)
    for (int column = 0; column < plane.columns; ++column) {
      const Vec3 p = plane.at(column, row);
      if (p.cwiseAbs().maxCoeff() > 9.0) continue;
      const double density = 1.0 + 0.02 * p.x() - 0.01 * p.y() + 0.03 * p.z();
      // Samples are rounded to 0.65 HU.
      ASSERT_NEAR(static_cast<double>(values[plane.index(column, row)]), (density - 0.131) / 0.001067, 0.35);
      ++inside;
    }
  EXPECT_GT(inside, 2000U);
}

TEST(Slice, IsAirOutsideTheBone) {
  const auto bone = BoneHu::make(test::ball_of_bone());
  ASSERT_TRUE(bone.has_value());
  for (const Vec3& centre : {Vec3(0, 0, 60), Vec3(-500, 0, 0), Vec3(0, 1e6, 0)})
    for (const float hu : slice_of(*bone, grid_about(centre, Vec3::UnitX(), Vec3::UnitY(), 0.5, 33, 9)))
      ASSERT_EQ(hu, -1000.0f);
}

TEST(Slice, EveryRegisterWidthGivesTheSameBytes) {
  CutField field(test::ball_of_bone(), {});
  const BoneHu bone = cut_ball(field);
  const PixelGrid plane =
      grid_about(Vec3(0.2, 0.1, 3.0), Vec3(1, 0.3, -0.2).normalized(), Vec3(-0.3, 1, 0).normalized(), 0.21, 101, 99);
  const int widest = limit_sampling_lanes(8);
  const std::vector<float> wide = slice_of(bone, plane);
  EXPECT_EQ(limit_sampling_lanes(4), 4);
  EXPECT_EQ(slice_of(bone, plane), wide);
  EXPECT_EQ(limit_sampling_lanes(8), widest);
}

TEST(Slice, PatientPlanesMeetInTheirPoint) {
  const Vec3 point(3, -4, 5);
  const PatientPlanes planes = patient_planes(point, {0.5, 101, 101});
  for (const PixelGrid& plane : {planes.axial, planes.coronal, planes.sagittal})
    EXPECT_LT((plane.at(50, 50) - point).norm(), 1e-12);
  // The patient's left (+x) is at the right, the feet (-z) are below, the front (-y) is at the left.
  EXPECT_GT(planes.axial.column_mm.x(), 0.0);
  EXPECT_GT(planes.axial.row_mm.y(), 0.0);
  EXPECT_GT(planes.coronal.column_mm.x(), 0.0);
  EXPECT_LT(planes.coronal.row_mm.z(), 0.0);
  EXPECT_GT(planes.sagittal.column_mm.y(), 0.0);
  EXPECT_LT(planes.sagittal.row_mm.z(), 0.0);
}

TEST(Slice, ToolPlanesHoldTheAxis) {
  const Pose tool = pose_along(Vec3(1, 2, 3), Vec3(1, 1, -3));
  const ToolPlanes planes = tool_planes(tool, {0.25, 65, 65});
  const Vec3 axis = Vec3(1, 1, -3).normalized();
  for (const PixelGrid& plane : {planes.along, planes.turned}) {
    EXPECT_LT((plane.at(32, 32) - tool.position_mm).norm(), 1e-12);
    EXPECT_LT((plane.row_mm - 0.25 * axis).norm(), 1e-12);
  }
  EXPECT_NEAR(planes.along.column_mm.dot(planes.turned.column_mm), 0.0, 1e-12);
  EXPECT_NEAR(planes.across.column_mm.dot(axis), 0.0, 1e-12);
  EXPECT_NEAR(planes.across.row_mm.dot(axis), 0.0, 1e-12);
}

}  // namespace
}  // namespace osteon::radiology
