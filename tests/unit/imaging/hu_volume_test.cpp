#include "common/imaging/hu_volume.hpp"

#include <gtest/gtest.h>

#include <algorithm>

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

TEST(HuVolume, APartHasItsVoxelsAtTheirPositions) {
  HuVolume volume = oblique();
  volume.values.resize(volume.count());
  for (std::size_t i = 0; i < volume.values.size(); ++i) volume.values[i] = static_cast<std::int16_t>(i);
  const std::array<int, 3> first{2, 0, 7}, last{9, 4, 7};
  const auto cut = cropped(volume, first, last, [](double) { return true; });
  ASSERT_TRUE(cut);
  const HuVolume& part = *cut;
  ASSERT_EQ(part.dims, (std::array<int, 3>{8, 5, 1})) << "both ends are included";
  ASSERT_EQ(part.values.size(), part.count());
  for (int slice = 0; slice < part.dims[2]; ++slice)
    for (int row = 0; row < part.dims[1]; ++row)
      for (int column = 0; column < part.dims[0]; ++column)
        EXPECT_EQ(part.at(column, row, slice), volume.at(column + first[0], row + first[1], slice + first[2]));
  EXPECT_LT((part.position_mm(Vec3(1, 2, 0)) - volume.position_mm(Vec3(3, 2, 7))).norm(), 1e-12);
}

// A slice of a long scan takes a millisecond, so a stop is asked for before each.
TEST(HuVolume, CroppingCanBeStoppedBeforeEachSlice) {
  HuVolume volume = oblique();
  volume.values.resize(volume.count());
  const std::array<int, 3> first{2, 0, 7}, last{9, 4, 11};
  std::vector<double> asked;
  ASSERT_TRUE(cropped(volume, first, last, [&](double done) { return asked.push_back(done), true; }));
  ASSERT_EQ(asked.size(), 5u);
  EXPECT_TRUE(std::ranges::is_sorted(asked));
  for (int stop = 1; stop <= 5; ++stop) {
    int questions = 0;
    const auto part = cropped(volume, first, last, [&](double) { return ++questions < stop; });
    ASSERT_FALSE(part) << stop;
    EXPECT_EQ(part.error().code, ErrorCode::cancelled);
  }
}

TEST(HuVolume, NearestHuRoundsHalvesAwayFromZero) {
  for (int hu = -40000; hu <= 40000; hu += 7) {
    const auto within = static_cast<std::int16_t>(std::clamp(hu, -32768, 32767));
    EXPECT_EQ(nearest_hu(hu), within);
    if (within != hu || within == -32768 || within == 32767) continue;
    for (const double part : {-0.49, -0.25, 0.25, 0.49}) EXPECT_EQ(nearest_hu(hu + part), hu) << hu << " " << part;
    EXPECT_EQ(nearest_hu(hu + 0.5), hu >= 0 ? hu + 1 : hu);
    EXPECT_EQ(nearest_hu(hu - 0.5), hu <= 0 ? hu - 1 : hu);
  }
  EXPECT_EQ(nearest_hu(1e300), 32767);
  EXPECT_EQ(nearest_hu(-1e300), -32768);
}

}  // namespace
}  // namespace osteon::imaging
