#include "common/imaging/hu_volume.hpp"

#include <gtest/gtest.h>

namespace osteon::imaging {
namespace {

HuVolume oblique() {
  HuVolume volume;
  volume.dims = {10, 20, 30};
  volume.spacing_mm = {0.5, 0.7, 2.0};
  volume.origin_mm = {-12.0, 34.0, -560.0};
  volume.directions = Eigen::AngleAxisd(0.4, Vec3(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  return volume;
}

TEST(HuVolume, VoxelAndPositionAreInverse) {
  const HuVolume volume = oblique();
  const Vec3 voxel(3.25, 11.5, 28.0);
  EXPECT_LT((volume.voxel(volume.position_mm(voxel)) - voxel).norm(), 1e-12);
  EXPECT_EQ(volume.position_mm(Vec3::Zero()), volume.origin_mm);
}

TEST(HuVolume, WorksMirrored) {
  HuVolume volume = oblique();
  volume.directions.col(1) *= -1.0;
  EXPECT_LT((volume.voxel(volume.position_mm(Vec3(1, 2, 3))) - Vec3(1, 2, 3)).norm(), 1e-12);
}

TEST(HuVolume, ScanEndsHalfAVoxelBeyondTheOuterCentres) {
  const HuVolume volume = oblique();
  EXPECT_NEAR(outside_scan_mm(volume, volume.position_mm(Vec3(9.5, 10, 15))), 0.0, 1e-9);
  EXPECT_NEAR(outside_scan_mm(volume, volume.position_mm(Vec3(5, 10, -0.5))), 0.0, 1e-9);
  EXPECT_NEAR(outside_scan_mm(volume, volume.position_mm(Vec3(11.5, 10, 15))), 1.0, 1e-9);     // two columns of 0.5 mm
  EXPECT_NEAR(outside_scan_mm(volume, volume.position_mm(Vec3(4.5, 0.5, 14.5))), -0.7, 1e-9);  // one row of 0.7 mm
}

TEST(HuVolume, EnclosingBoxHoldsEveryCorner) {
  const HuVolume volume = oblique();
  const Box box = enclosing_box(volume, Vec3(0, 0, 0), Vec3(9, 19, 29));
  for (const double i : {0.0, 9.0})
    for (const double j : {0.0, 19.0})
      for (const double k : {0.0, 29.0}) {
        const Vec3 corner = volume.position_mm(Vec3(i, j, k));
        EXPECT_TRUE(((corner - box.min_mm).array() >= -1e-9).all() && ((box.max_mm - corner).array() >= -1e-9).all());
      }
}

TEST(HuVolume, APartHasItsVoxelsAtTheirPlaces) {
  HuVolume whole = oblique();
  for (int i = 0; i < 10 * 20 * 30; ++i) whole.values.push_back(static_cast<std::int16_t>(i));
  const std::array<int, 3> first{2, 0, 5}, last{7, 19, 5};
  const HuVolume part = cropped(whole, first, last);
  ASSERT_EQ(part.dims, (std::array<int, 3>{6, 20, 1}));
  ASSERT_EQ(part.values.size(), 6u * 20u);
  std::size_t at = 0;
  for (int row = 0; row <= 19; ++row)
    for (int column = 2; column <= 7; ++column, ++at)
      EXPECT_EQ(part.values[at], column + 10 * (row + 20 * 5)) << column << " " << row;
  EXPECT_LT((part.position_mm(Vec3(1, 2, 0)) - whole.position_mm(Vec3(3, 2, 5))).norm(), 1e-12);
}

}  // namespace
}  // namespace osteon::imaging
