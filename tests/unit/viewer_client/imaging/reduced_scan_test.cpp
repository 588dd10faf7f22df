// A scan in fewer voxels: where they lie, how many there are, and what they hold.
#include "viewer_client/imaging/reduced_scan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

namespace osteon {
namespace {

ScanGeometry geometry(const std::array<int, 3>& dims, const Vec3& spacing_mm) {
  ScanGeometry scan;
  scan.dims = dims;
  scan.origin_mm = {-40.0, 11.0, 7.0};
  scan.axes_mm = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix() * spacing_mm.asDiagonal();
  return scan;
}

const KeepGoing kToTheEnd = [](double) { return true; };

TEST(ReducedScan, EveryScanFitsIntoEightMebibytes) {
  for (const auto& [dims, spacing] :
       std::vector<std::pair<std::array<int, 3>, Vec3>>{{{512, 512, 2000}, {0.7, 0.7, 0.5}},
                                                        {{512, 512, 46}, {0.84, 0.84, 3.0}},
                                                        {{16384, 1, 1}, {0.1, 0.1, 0.1}},
                                                        {{160, 161, 3}, {1.0, 1.0, 8.0}},
                                                        {{1023, 767, 511}, {0.31, 0.29, 0.62}}}) {
    const ScanBlocks blocks = blocks_of(geometry(dims, spacing));
    EXPECT_LE(sizeof(std::int16_t) * blocks.geometry.count(), std::size_t{8} << 20);
    double longest_mm = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int count = blocks.geometry.dims[axis], step = blocks.step[axis];
      EXPECT_LE(count, kMostReducedEdge);
      // The blocks cover the scan, and none is beside it.
      EXPECT_GE(count * step, dims[axis]);
      EXPECT_LT((count - 1) * step, dims[axis]);
      longest_mm = std::max(longest_mm, dims[axis] * spacing[static_cast<int>(axis)]);
    }
    // No edge is longer than the bound asks for, but for the voxel that cannot be divided.
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_LE(blocks.geometry.axes_mm.col(axis).norm(), longest_mm / kMostReducedEdge + 1.01 * spacing[axis]);
  }
}

TEST(ReducedScan, ASmallScanStaysAsItIs) {
  ShownScan scan{geometry({3, 2, 2}, {0.5, 0.6, 2.0}), {1, -2, 3, 4, -1000, 3071, 7, 8, 9, 10, 11, 12}};
  const auto reduced = reduced_scan(scan, kToTheEnd);
  ASSERT_TRUE(reduced);
  EXPECT_EQ(reduced->values, scan.values);
  EXPECT_EQ(reduced->geometry.dims, scan.geometry.dims);
  EXPECT_LT((reduced->geometry.origin_mm - scan.geometry.origin_mm).norm(), 1e-9);
}

// The mean of a linear function over a block is its value in the block's middle.
TEST(ReducedScan, EachVoxelHasTheMeanOfItsBlock) {
  const ScanGeometry fine = geometry({500, 30, 20}, {0.5, 0.5, 0.9});
  const auto hu_at = [&](const Vec3& at_mm) { return 3.0 * at_mm.x() - 2.0 * at_mm.y() + 5.0 * at_mm.z(); };
  ShownScan scan{fine, {}};
  for (int k = 0; k < fine.dims[2]; ++k)
    for (int j = 0; j < fine.dims[1]; ++j)
      for (int i = 0; i < fine.dims[0]; ++i)
        scan.values.push_back(static_cast<std::int16_t>(std::lround(hu_at(fine.position_mm(Vec3(i, j, k))))));
  const ScanBlocks blocks = blocks_of(fine);
  // 250 mm in 160 voxels: 1.5625 mm.
  EXPECT_EQ(blocks.step, (std::array<int, 3>{4, 4, 2}));
  const auto reduced = reduced_scan(scan, kToTheEnd);
  ASSERT_TRUE(reduced);
  for (int k = 0; k < 10; ++k)
    for (int j = 0; j < 7; ++j)  // the last row of blocks is half a one
      for (int i = 0; i < 125; ++i)
        ASSERT_NEAR(reduced->at({i, j, k}), hu_at(reduced->geometry.position_mm(Vec3(i, j, k))), 1.0);
  scan.values.assign(fine.count(), -77);
  EXPECT_EQ(reduced_scan(scan, kToTheEnd)->values, std::vector<std::int16_t>(125 * 8 * 10, -77));
}

TEST(ReducedScan, CanBeStopped) {
  const ShownScan scan{geometry({4, 4, 9}, {1, 1, 1}), std::vector<std::int16_t>(144, 5)};
  int asked = 0;
  const auto stopped = reduced_scan(scan, [&](double) { return ++asked < 4; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  EXPECT_EQ(asked, 4);
}

}  // namespace
}  // namespace osteon
