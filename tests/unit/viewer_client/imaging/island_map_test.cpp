#include "viewer_client/imaging/island_map.hpp"

#include <gtest/gtest.h>

namespace osteon {
namespace {

using Voxel = std::array<int, 3>;

ShownScan scan_of(int width) {
  ShownScan scan;
  scan.geometry.dims = {width, width, width};
  scan.geometry.origin_mm = {-10.0, 5.0, 2.0};
  scan.geometry.axes_mm = Vec3(0.5, 0.5, 2.0).asDiagonal();
  scan.values.assign(scan.geometry.count(), 0);
  return scan;
}

// The part of 4 x 4 x 4 voxels from `first` on.
VoxelFile<std::uint8_t> part_of(const ShownScan& scan, const Voxel& first) {
  VoxelFile<std::uint8_t> part;
  part.geometry = scan.geometry;
  part.geometry.dims = {4, 4, 4};
  part.geometry.origin_mm = centre_of(scan.geometry, first);
  part.values.assign(64, 0);
  return part;
}

TEST(IslandMap, LiesInItsPartOfTheScan) {
  const ShownScan scan = scan_of(8);
  auto part = part_of(scan, {2, 3, 1});
  part.values[part.index({0, 0, 0})] = 7;
  part.values[part.index({3, 1, 2})] = 9;
  const auto map = IslandMap::make(scan.geometry, part);
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(map->number({2, 3, 1}), 7);
  EXPECT_EQ(map->number({5, 4, 3}), 9);
  EXPECT_EQ(map->number({0, 0, 0}), 0);
  EXPECT_EQ(map->number({7, 7, 7}), 0);
  EXPECT_EQ(IslandMap().number({2, 3, 1}), 0);
}

TEST(IslandMap, OfAnotherScanIsRefused) {
  const ShownScan scan = scan_of(8);
  EXPECT_FALSE(IslandMap::make(scan.geometry, part_of(scan, {5, 0, 0})));  // reaches beyond it
  auto shifted = part_of(scan, {2, 2, 2});
  shifted.geometry.origin_mm.x() += 0.1;
  EXPECT_FALSE(IslandMap::make(scan.geometry, shifted));
  auto finer = part_of(scan, {2, 2, 2});
  finer.geometry.axes_mm *= 0.5;
  EXPECT_FALSE(IslandMap::make(scan.geometry, finer));
}

// Marrow belongs to a bone and is below its threshold. The seed is in the nearest compact voxel, in millimetres: two
// voxels to the side (1 mm) are nearer than one slice (2 mm).
TEST(IslandMap, GivesTheNearestSeedAboveTheThreshold) {
  ShownScan scan = scan_of(8);
  auto part = part_of(scan, {2, 2, 2});
  const auto put = [&](const Voxel& at, std::int16_t hu, std::uint8_t island) {
    scan.values[scan.index(at)] = hu;
    part.values[part.index({at[0] - 2, at[1] - 2, at[2] - 2})] = island;
  };
  put({3, 3, 3}, 100, 1);  // marrow
  put({4, 3, 3}, 199, 1);
  put({5, 3, 3}, 200, 1);
  put({3, 3, 4}, 900, 1);
  put({3, 4, 3}, 900, 2);  // another bone, beside it
  const auto map = IslandMap::make(scan.geometry, part);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->seed_near(scan, 1, 200.0, {3, 3, 3}), (Voxel{5, 3, 3}));
  EXPECT_EQ(map->seed_near(scan, 1, 201.0, {3, 3, 3}), (Voxel{3, 3, 4}));
  EXPECT_EQ(map->seed_near(scan, 2, 200.0, {0, 0, 0}), (Voxel{3, 4, 3}));
  EXPECT_FALSE(map->seed_near(scan, 1, 901.0, {3, 3, 3}));
  EXPECT_FALSE(map->seed_near(scan, 3, 200.0, {3, 3, 3}));
}

// A crumb that hangs on a bone by a corner is nearer to the bone's middle than the bone. It is no seed of the bone.
TEST(IslandMap, GivesASeedOfTheLargestPiece) {
  ShownScan scan = scan_of(8);
  auto part = part_of(scan, {2, 2, 2});
  const auto put = [&](const Voxel& at) {
    scan.values[scan.index(at)] = 900;
    part.values[part.index({at[0] - 2, at[1] - 2, at[2] - 2})] = 1;
  };
  put({2, 2, 2});  // the crumb
  for (const Voxel& at : {Voxel{3, 3, 3}, {3, 3, 4}, {3, 3, 5}, {4, 3, 5}, {5, 3, 5}, {5, 4, 5}}) put(at);
  const auto map = IslandMap::make(scan.geometry, part);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->seed_near(scan, 1, 200.0, {2, 2, 2}), (Voxel{2, 2, 2}));
  EXPECT_EQ(map->main_seed_near(scan, 1, 200.0, {2, 2, 2}), (Voxel{3, 3, 3}));
  EXPECT_EQ(map->main_seed_near(scan, 1, 200.0, {5, 5, 5}), (Voxel{5, 4, 5}));
  EXPECT_FALSE(map->main_seed_near(scan, 1, 901.0, {2, 2, 2}));
  EXPECT_FALSE(map->main_seed_near(scan, 2, 200.0, {2, 2, 2}));
}

// What a person has ticked at a low threshold is still what is made at a high one.
TEST(IslandMap, MovesSeedsAboveTheThreshold) {
  ShownScan scan = scan_of(8);
  auto part = part_of(scan, {2, 2, 2});
  const auto put = [&](const Voxel& at, std::int16_t hu, std::uint8_t island) {
    scan.values[scan.index(at)] = hu;
    part.values[part.index({at[0] - 2, at[1] - 2, at[2] - 2})] = island;
  };
  put({3, 3, 3}, 300, 1);  // marrow at the new threshold
  put({4, 3, 3}, 900, 1);
  put({3, 5, 3}, 900, 2);
  scan.values[scan.index({2, 2, 2})] = 300;  // in no island
  const auto map = IslandMap::make(scan.geometry, part);
  ASSERT_TRUE(map);
  const auto at = [&](const Voxel& voxel) { return centre_of(scan.geometry, voxel); };
  const std::vector<Vec3> seeds{at({3, 3, 3}), at({3, 5, 3}), at({2, 2, 2}), at({4, 3, 3})};
  EXPECT_EQ(map->moved_seeds(scan, 500.0, seeds), (std::vector<Vec3>{at({4, 3, 3}), at({3, 5, 3})}));
}

TEST(IslandMap, FindsTheVoxelOfAPosition) {
  const ScanGeometry scan = scan_of(8).geometry;
  for (const Voxel& voxel : {Voxel{0, 0, 0}, Voxel{7, 3, 1}, Voxel{7, 7, 7}})
    EXPECT_EQ(voxel_of(scan, centre_of(scan, voxel)), voxel);
  EXPECT_EQ(voxel_of(scan, {-10.2, 5.0, 2.0}), (Voxel{0, 0, 0}));
  EXPECT_FALSE(voxel_of(scan, {-10.3, 5.0, 2.0}));
  EXPECT_FALSE(voxel_of(scan, {0.0, 0.0, 100.0}));
}

}  // namespace
}  // namespace osteon
