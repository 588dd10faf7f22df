#include "viewer_client/imaging/plane_picture.hpp"

#include <gtest/gtest.h>

#include <tuple>
#include <vector>

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

// Islands 2 and 3 are one bone, island 4 is of two bones, and island 5 is of none.
TEST(PlanePicture, ABoneHasOneTintInAllItsIslands) {
  const auto colour = [](const Tint& tint) { return std::tuple(tint.red, tint.green, tint.blue); };
  PlaneLook look;
  look.kept[2].set(6);
  look.kept[3].set(6);
  look.kept[4].set(8);
  look.kept[4].set(9);
  const std::vector<BoneLabel> labels{{6, "femur", 50, 0.0}, {9, "tibia", 0, 0.0}};
  set_tints(look, labels);
  EXPECT_EQ(look.islands[2], look.islands[3]);
  EXPECT_EQ(look.islands[2], look.bones[6]);
  EXPECT_EQ(colour(look.bones[6]), colour(tint_of(2, true)));
  EXPECT_NEAR(opacity_of(look.bones[6]), 0.5, 0.01);
  EXPECT_EQ(look.islands[4], look.bones[8]) << "the lowest bone is shown";
  EXPECT_EQ(opacity_of(look.bones[8]), 1.0);
  EXPECT_EQ(opacity_of(look.bones[9]), 0.0);
  EXPECT_EQ(look.islands[5], tint_of(5, false));
}

}  // namespace
}  // namespace osteon
