#include "common/imaging/islands.hpp"

#include <gtest/gtest.h>

#include "common/imaging/resample.hpp"

namespace osteon::imaging {
namespace {

constexpr double kThreshold_hu = 226.0;
bool always(double) { return true; }

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

TEST(Islands, KeepsTheLargestAndPullsTheOthersBelowTheThreshold) {
  HuVolume volume = empty_volume();
  fill(volume, {2, 2, 2}, {9, 9, 9}, 900);
  fill(volume, {14, 14, 4}, {16, 16, 6}, 1500);
  fill(volume, {20, 3, 12}, {20, 3, 12}, 226);
  const auto report = keep_largest_island(volume, kThreshold_hu, always);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->islands, 3);
  EXPECT_EQ(report->kept_voxels, 512);
  EXPECT_EQ(report->removed_voxels, 28);
  EXPECT_EQ(report->first, (std::array<int, 3>{2, 2, 2}));
  EXPECT_EQ(report->last, (std::array<int, 3>{9, 9, 9}));
  EXPECT_EQ(volume.at(5, 5, 5), 900);
  EXPECT_EQ(volume.at(15, 15, 5), 225);
  EXPECT_EQ(volume.at(20, 3, 12), 225);
  EXPECT_EQ(volume.at(12, 12, 12), -100);
}

TEST(Islands, NeighboursAcrossACornerAreOne) {
  // Every one of the 26 directions from one voxel to a second.
  for (int d = 0; d < 27; ++d) {
    if (d == 13) continue;
    HuVolume volume = empty_volume();
    volume.values[volume.index(10, 10, 8)] = 500;
    volume.values[volume.index(10 + d % 3 - 1, 10 + d / 3 % 3 - 1, 8 + d / 9 - 1)] = 500;
    const auto report = keep_largest_island(volume, kThreshold_hu, always);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->islands, 1) << "direction " << d;
  }
}

TEST(Islands, AGapOfOneVoxelParts) {
  HuVolume volume = empty_volume();
  fill(volume, {2, 2, 2}, {5, 5, 5}, 500);
  fill(volume, {7, 2, 2}, {9, 5, 5}, 500);
  const auto report = keep_largest_island(volume, kThreshold_hu, always);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->islands, 2);
  EXPECT_EQ(report->kept_voxels, 64);
}

TEST(Islands, ABridgeFoundLateJoinsWhatWasApart) {
  // A U lying on its side: two arms that meet only in the last slice.
  HuVolume volume = empty_volume();
  fill(volume, {2, 2, 2}, {3, 3, 12}, 500);
  fill(volume, {12, 2, 2}, {13, 3, 12}, 500);
  fill(volume, {2, 2, 13}, {13, 3, 13}, 500);
  const auto report = keep_largest_island(volume, kThreshold_hu, always);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->islands, 1);
  EXPECT_EQ(report->removed_voxels, 0);
}

TEST(Islands, DoesNotMoveTheKeptSurface) {
  HuVolume volume = empty_volume();
  fill(volume, {2, 2, 2}, {9, 9, 9}, 900);
  fill(volume, {11, 4, 4}, {15, 7, 7}, 1500);  // as near as another island can be
  const HuVolume before = volume;
  ASSERT_TRUE(keep_largest_island(volume, kThreshold_hu, always));
  // Wherever the interpolated value stands in a cell with a kept voxel it is the same as before.
  for (double x = 1.0; x <= 10.0; x += 0.125) {
    const CoordBox at{{static_cast<int>(x * 8), 40, 40}, {static_cast<int>(x * 8), 48, 48}};
    const auto a = resample(before, at, 0.125, always);
    const auto b = resample(volume, at, 0.125, always);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->values, b->values) << "x " << x;
  }
}

TEST(Islands, ABoneAcrossTheWholeScanIsFound) {
  HuVolume volume = empty_volume();
  std::ranges::fill(volume.values, 1000);
  const auto report = keep_largest_island(volume, kThreshold_hu, always);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->kept_voxels, static_cast<std::int64_t>(volume.count()));
}

TEST(Islands, NothingAboveTheThresholdNamesTheRemedy) {
  HuVolume volume = empty_volume();
  const auto report = keep_largest_island(volume, kThreshold_hu, always);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::invalid_input);
  EXPECT_NE(report.error().message.find("--threshold"), std::string::npos);
}

TEST(Islands, StopsWhenAsked) {
  HuVolume volume = empty_volume();
  const auto report = keep_largest_island(volume, kThreshold_hu, [](double) { return false; });
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon::imaging
