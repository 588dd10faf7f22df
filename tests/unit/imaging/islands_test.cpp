#include "common/imaging/islands.hpp"

#include <gtest/gtest.h>

#include "common/imaging/bone_field.hpp"
#include "common/imaging/calibration.hpp"
#include "common/imaging/resample.hpp"
#include "common/imaging/segmentation.hpp"
#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

constexpr double kThreshold_hu = 226.0;
HuVolume empty_volume() {
  HuVolume volume;
  volume.dims = {24, 20, 16};
  volume.values.assign(volume.count(), -100);
  return volume;
}

void fill(HuVolume& volume, std::array<int, 3> first, std::array<int, 3> last, std::int16_t hu) {
  for (int k = first[2]; k <= last[2]; ++k)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i) volume.values[volume.index(i, j, k)] = hu;
}

Islands islands_of(const HuVolume& volume) {
  const auto bone = segment_bone(volume, {.hollow = true}, kAllScanEnds, always);
  EXPECT_TRUE(bone);
  auto found = find_islands(volume, *bone, kRho1995, always);
  EXPECT_TRUE(found);
  return std::move(*found);
}

TEST(Islands, AreListedFromTheLargestWithVolumeCentreAndDensity) {
  HuVolume volume = empty_volume();
  volume.spacing_mm = {0.5, 1.0, 2.0};
  volume.origin_mm = {10.0, 20.0, 30.0};
  fill(volume, {14, 14, 4}, {16, 16, 6}, 1500);
  fill(volume, {2, 2, 2}, {9, 9, 9}, 900);
  fill(volume, {20, 3, 12}, {20, 3, 12}, 226);
  const Islands islands = islands_of(volume);
  ASSERT_EQ(islands.list.size(), 3u);
  EXPECT_EQ(islands.list[0].voxels, 512);
  EXPECT_EQ(islands.list[1].voxels, 27);
  EXPECT_EQ(islands.list[2].voxels, 1);
  EXPECT_NEAR(islands.list[0].volume_cm3, 0.512, 1e-9);
  EXPECT_NEAR(islands.list[0].density_g_cm3, 0.131 + 0.001067 * 900, 1e-6);
  EXPECT_LT((islands.list[0].centre_mm - Vec3(10.0 + 5.5 * 0.5, 20.0 + 5.5, 30.0 + 5.5 * 2.0)).norm(), 1e-9);
  EXPECT_EQ(islands.list[0].first, (std::array<int, 3>{2, 2, 2}));
  EXPECT_EQ(islands.list[0].last, (std::array<int, 3>{9, 9, 9}));
}

TEST(Islands, DensityOfMetalCountsAsCompactBones) {
  HuVolume volume = empty_volume();
  fill(volume, {2, 2, 2}, {4, 4, 4}, 3071);
  EXPECT_NEAR(islands_of(volume).list[0].density_g_cm3, 2.1, 1e-9);
}

TEST(Islands, KeptOnesGetNumbersInTheirOrder) {
  HuVolume volume = empty_volume();
  fill(volume, {2, 2, 2}, {9, 9, 9}, 900);
  fill(volume, {14, 14, 4}, {16, 16, 6}, 1500);
  fill(volume, {20, 3, 12}, {20, 3, 12}, 226);
  const Islands islands = islands_of(volume);
  const std::array kept{3, 1};
  const VoxelMask bones = number_bones(islands, kept, false, volume.dims);
  EXPECT_EQ(bones.at(20, 3, 12), 1);
  EXPECT_EQ(bones.at(5, 5, 5), 2);
  EXPECT_EQ(bones.at(15, 15, 5), 0);
  EXPECT_EQ(bones.at(12, 12, 12), 0);
  const VoxelMask merged = number_bones(islands, kept, true, volume.dims);
  EXPECT_EQ(merged.at(20, 3, 12), 1);
  EXPECT_EQ(merged.at(5, 5, 5), 1);
}

TEST(Islands, NeighboursAcrossACornerAreOne) {
  // Each of the 26 directions from one voxel to a second.
  for (int d = 0; d < 27; ++d) {
    if (d == 13) continue;
    HuVolume volume = empty_volume();
    volume.values[volume.index(10, 10, 8)] = 500;
    volume.values[volume.index(10 + d % 3 - 1, 10 + d / 3 % 3 - 1, 8 + d / 9 - 1)] = 500;
    EXPECT_EQ(islands_of(volume).list.size(), 1u) << "direction " << d;
  }
}

TEST(Islands, AGapOfOneVoxelParts) {
  HuVolume volume = empty_volume();
  fill(volume, {2, 2, 2}, {5, 5, 5}, 500);
  fill(volume, {7, 2, 2}, {9, 5, 5}, 500);
  const Islands islands = islands_of(volume);
  ASSERT_EQ(islands.list.size(), 2u);
  EXPECT_EQ(islands.list[0].voxels, 64);
}

TEST(Islands, ABridgeFoundLateJoinsWhatWasApart) {
  // A U on its side: two arms that meet only in the last slice.
  HuVolume volume = empty_volume();
  fill(volume, {2, 2, 2}, {3, 3, 12}, 500);
  fill(volume, {12, 2, 2}, {13, 3, 12}, 500);
  fill(volume, {2, 2, 13}, {13, 3, 13}, 500);
  EXPECT_EQ(islands_of(volume).list.size(), 1u);
}

TEST(Islands, ABoneAcrossTheWholeScanIsFound) {
  HuVolume volume = empty_volume();
  std::ranges::fill(volume.values, std::int16_t{1000});
  EXPECT_EQ(islands_of(volume).list[0].voxels, static_cast<std::int64_t>(volume.count()));
}

TEST(Islands, StopsWhenAsked) {
  HuVolume volume = empty_volume();
  fill(volume, {2, 2, 2}, {5, 5, 5}, 500);
  const auto bone = segment_bone(volume, {.hollow = true}, kAllScanEnds, always);
  ASSERT_TRUE(bone);
  const auto found = find_islands(volume, *bone, kRho1995, [](double) { return false; });
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::cancelled);
}

// The whole field as a volume.
HuVolume field_of(const HuVolume& volume, const VoxelMask& bones) {
  HuVolume field = volume;
  const VoxelBox whole{{0, 0, 0}, {volume.dims[0] - 1, volume.dims[1] - 1, volume.dims[2] - 1}};
  const SurfaceLevel level{kThreshold_hu};
  const SparseMask kept(bones);
  BoneField::make(volume, kept, level, always)->read(whole, field.values);
  return field;
}

TEST(BoneField, OtherIslandsDoNotMoveTheKeptSurface) {
  HuVolume volume = empty_volume();
  fill(volume, {2, 2, 2}, {9, 9, 9}, 900);
  fill(volume, {11, 4, 4}, {15, 7, 7}, 1500);  // as near as another island can be
  const Islands islands = islands_of(volume);
  const std::array kept{1};
  const HuVolume field = field_of(volume, number_bones(islands, kept, false, volume.dims));
  EXPECT_EQ(field.at(13, 5, 5), 225);
  // Wherever the interpolated value matters in a cell with a kept voxel, it is the same as before.
  for (double x = 1.0; x <= 10.0; x += 0.125) {
    const CoordBox at{{static_cast<int>(x * 8), 40, 40}, {static_cast<int>(x * 8), 48, 48}};
    const auto a = resample(volume, at, 0.125, always);
    const auto b = resample(field, at, 0.125, always);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->values, b->values) << "x " << x;
  }
}

// Where the field crosses the threshold between two voxels along x, as a fraction of the distance.
double crossing(const HuVolume& field, int column) {
  const double a = field.at(column, 5, 5), b = field.at(column + 1, 5, 5);
  return (a - kThreshold_hu) / (a - b);
}

TEST(BoneField, MarrowEndsHalfWayToAirAndHalfWayBetweenVoxelsElsewhere) {
  HuVolume volume = empty_volume();
  VoxelMask bones(volume.dims);
  for (int column = 0; column < 24; ++column)
    for (int row = 0; row < 20; ++row)
      for (int slice = 0; slice < 16; ++slice) {
        volume.values[volume.index(column, row, slice)] = column < 8 ? 100 : column == 8 ? -340 : -1000;
        bones.at(column, row, slice) = column < 8 ? 1 : 0;
      }
  HuVolume field = field_of(volume, bones);
  // Linear between 100 and -340, the value half way to air, -450, would lie beyond the second voxel. So the crossing is
  // as far as possible.
  EXPECT_GT(crossing(field, 7), 0.9);
  EXPECT_LT(crossing(field, 7), 1.0);
  for (int row = 0; row < 20; ++row)
    for (int slice = 0; slice < 16; ++slice) volume.values[volume.index(8, row, slice)] = -1000;
  field = field_of(volume, bones);
  EXPECT_NEAR(crossing(field, 7), 0.5, 0.01);
  for (int row = 0; row < 20; ++row)
    for (int slice = 0; slice < 16; ++slice) volume.values[volume.index(8, row, slice)] = 40;
  field = field_of(volume, bones);
  EXPECT_NEAR(crossing(field, 7), 0.5, 0.01);
}

TEST(BoneField, APartHasTheVoxelsOfTheWholeAndTheirSide) {
  HuVolume volume = empty_volume();
  fill(volume, {3, 2, 2}, {14, 12, 12}, 900);
  fill(volume, {6, 5, 5}, {11, 9, 9}, 60);  // marrow
  const Islands islands = islands_of(volume);
  const std::array kept{1};
  const VoxelMask bones = number_bones(islands, kept, false, volume.dims);
  const HuVolume whole = field_of(volume, bones);
  const SurfaceLevel level{kThreshold_hu};
  const SparseMask sparse(bones);
  const auto field = BoneField::make(volume, sparse, level, always);
  ASSERT_TRUE(field);
  std::array<int, 3> found{};
  for (int i = 0; i < 200; ++i) {
    VoxelBox part;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      part.first[axis] = (i * (5 + static_cast<int>(axis))) % (volume.dims[axis] - 4);
      part.last[axis] = std::min(part.first[axis] + i % 5, volume.dims[axis] - 1);
    }
    std::vector<std::int16_t> values(part.count());
    field->read(part, values);
    std::size_t inside = 0;
    for (int z = part.first[2]; z <= part.last[2]; ++z)
      for (int y = part.first[1]; y <= part.last[1]; ++y)
        for (int x = part.first[0]; x <= part.last[0]; ++x) {
          EXPECT_EQ(values[part.index(x, y, z)], whole.at(x, y, z));
          inside += whole.at(x, y, z) >= kThreshold_hu ? 1 : 0;
        }
    const Inside side = inside == 0 ? Inside::none : inside == values.size() ? Inside::all : Inside::some;
    EXPECT_EQ(field->inside(part), side);
    ++found[static_cast<std::size_t>(side)];
  }
  for (const int count : found) EXPECT_GT(count, 5);
}

}  // namespace
}  // namespace osteon::imaging
