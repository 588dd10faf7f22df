// Scans and labels on the voxels of another scan, against fields that trilinear values give exactly.
#include "common/imaging/moved_volume.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace osteon::imaging {
namespace {

bool never_cancel(double) { return true; }

const Pose kPose{Vec3(3, -2, 5), Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vec3(1, 1, 2).normalized()))};

HuVolume moving_grid() {
  HuVolume grid;
  grid.dims = {20, 18, 16};
  grid.spacing_mm = {1.0, 1.5, 2.0};
  grid.origin_mm = {-10, 4, 7};
  grid.directions = Eigen::AngleAxisd(-0.5, Vec3(0, 1, 0.2).normalized()).toRotationMatrix();
  return grid;
}

// Around the middle of the moving scan, and beyond it on all sides.
HuVolume fixed_grid() {
  HuVolume grid;
  grid.dims = {32, 30, 28};
  grid.spacing_mm = {1.6, 1.4, 1.8};
  const Vec3 middle = kPose.point(moving_grid().position_mm(Vec3(9.5, 8.5, 7.5)));
  grid.origin_mm = middle - grid.spacing_mm.cwiseProduct(Vec3(15.5, 14.5, 13.5));
  return grid;
}

double line_hu(const Vec3& at) { return 11.0 * at.x() - 7.0 * at.y() + 5.0 * at.z() + 100.0; }

// The sides of the moving scan that a point lies beyond, measured by its own axes; negative within.
Vec3 beyond_voxels(const Vec3& fixed_mm) {
  const HuVolume grid = moving_grid();
  const Vec3 back = kPose.rotation.conjugate() * (fixed_mm - kPose.position_mm);
  const Vec3 voxel = (grid.directions.transpose() * (back - grid.origin_mm)).cwiseQuotient(grid.spacing_mm);
  const Vec3 half(9.5, 8.5, 7.5);
  return (voxel - half).cwiseAbs() - half;
}

template <class Check>
void for_all(const HuVolume& grid, Check check) {
  std::size_t i = 0;
  for (int slice = 0; slice < grid.dims[2]; ++slice)
    for (int row = 0; row < grid.dims[1]; ++row)
      for (int column = 0; column < grid.dims[0]; ++column) check(i++, grid.position_mm(Vec3(column, row, slice)));
}

TEST(MovedVolume, HasTheValuesOfALinearField) {
  HuVolume moving = moving_grid();
  moving.values.resize(moving.count());
  for_all(moving, [&](std::size_t i, const Vec3& at) {
    moving.values[i] = static_cast<std::int16_t>(std::lround(line_hu(at)));
  });
  const HuVolume fixed = fixed_grid();
  const auto moved = moved_hu(fixed, moving, kPose, never_cancel);
  ASSERT_TRUE(moved);
  int within = 0, outside = 0;
  for_all(fixed, [&](std::size_t i, const Vec3& at) {
    const double beyond = beyond_voxels(at).maxCoeff();
    if (beyond > 0.51) {
      EXPECT_EQ((*moved)[i], kBeyondScan_hu);
      ++outside;
    } else if (beyond < 0.0) {
      EXPECT_NEAR((*moved)[i], line_hu(kPose.inverse().point(at)), 1.01) << "both were rounded";
      ++within;
    }
  });
  EXPECT_GT(within, 1000);
  EXPECT_GT(outside, 1000);
}

TEST(MovedVolume, LabelsAreThoseOfTheNearestVoxel) {
  const HuVolume moving = moving_grid(), fixed = fixed_grid();
  std::vector<std::uint16_t> labels(moving.count());
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = static_cast<std::uint16_t>(i + 1);
  const auto moved = moved_labels(fixed, moving, labels, kPose, never_cancel);
  ASSERT_TRUE(moved);
  int checked = 0;
  for_all(fixed, [&](std::size_t i, const Vec3& at) {
    const double beyond = beyond_voxels(at).maxCoeff();
    if (beyond > 0.501) {
      EXPECT_EQ((*moved)[i], 0);
    }
    if (beyond > 0.0 || i % 7 != 0) return;
    double nearest = 1e9;
    std::size_t label = 0;
    const Vec3 back = (moving.directions.transpose() * (kPose.inverse().point(at) - moving.origin_mm))
                          .cwiseQuotient(moving.spacing_mm);
    std::size_t n = 0;
    for (int slice = 0; slice < moving.dims[2]; ++slice)
      for (int row = 0; row < moving.dims[1]; ++row)
        for (int column = 0; column < moving.dims[0]; ++column, ++n)
          if (const double d = (Vec3(column, row, slice) - back).squaredNorm(); d < nearest) nearest = d, label = n + 1;
    EXPECT_EQ((*moved)[i], label);
    ++checked;
  });
  EXPECT_GT(checked, 100);
}

TEST(MovedVolume, StopsWhenAsked) {
  HuVolume moving = moving_grid();
  moving.values.resize(moving.count());
  const auto moved = moved_hu(fixed_grid(), moving, kPose, [](double done) { return done < 0.5; });
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon::imaging
