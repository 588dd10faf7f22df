#include "viewer_client/imaging/plane_picture.hpp"

#include <gtest/gtest.h>

#include <tuple>

namespace osteon {
namespace {

// Two columns, one row, one slice of 100 and 200 HU. The second voxel is island 1. In this window a HU is a grey.
struct TwoVoxels {
  ShownScan scan;
  IslandMap islands;
  PlaneLook look;
  GreyTable greys{{127.5, 255.0}};

  TwoVoxels() {
    scan.geometry.dims = {2, 1, 1};
    scan.values = {100, 200};
    VoxelFile<std::uint8_t> numbers;
    numbers.geometry.dims = {2, 1, 1};
    numbers.values = {0, 1};
    islands = *IslandMap::make(scan.geometry, numbers);
  }
  [[nodiscard]] std::vector<std::uint32_t> draw() const {
    return draw_plane(scan, islands, axes_of(scan.geometry, Plane::axial), 0, look, greys);
  }
};

TEST(PlanePicture, ShowsTheGreysOfTheWindow) {
  const TwoVoxels two;
  EXPECT_EQ(two.draw(), (std::vector<std::uint32_t>{0xff646464u, 0xffc8c8c8u}));
}

// A strength of s is a mixture: (255 - s) / 255 of the grey, s / 255 of the colour.
TEST(PlanePicture, TintsAnIslandByTheStrengthOfItsTint) {
  TwoVoxels two;
  two.look.islands[1] = {10, 20, 30, 255};
  EXPECT_EQ(two.draw(), (std::vector<std::uint32_t>{0xff646464u, 0xff0a141eu}));
  two.look.islands[1] = {0, 255, 200, 51};  // a fifth
  // 0.8 * 200 + 0.2 * 0, 255 and 200.
  EXPECT_EQ(two.draw()[1], 0xffa0d3c8u);
}

TEST(PlanePicture, TintsWhatReachesTheThreshold) {
  TwoVoxels two;
  two.look.islands[1] = {10, 20, 30, 255};
  two.look.threshold_hu = 100.0;
  const auto both = two.draw();
  EXPECT_NE(both[0], 0xff646464u);
  two.look.threshold_hu = 100.5;
  EXPECT_EQ(two.draw()[0], 0xff646464u);
  EXPECT_EQ(two.draw()[1], both[1]);
  two.look.threshold_hu = 201.0;
  EXPECT_EQ(two.draw()[1], 0xffc8c8c8u);
}

TEST(PlanePicture, NeighboursInTheListHaveOtherColours) {
  for (int island = 1; island < 254; ++island) {
    const Tint a = tint_of(island, true), b = tint_of(island + 1, true), left_out = tint_of(island, false);
    EXPECT_NE(std::tie(a.red, a.green, a.blue), std::tie(b.red, b.green, b.blue)) << island;
    EXPECT_EQ(std::tie(a.red, a.green, a.blue), std::tie(left_out.red, left_out.green, left_out.blue));
    EXPECT_GT(a.strength, left_out.strength);
  }
}

}  // namespace
}  // namespace osteon
