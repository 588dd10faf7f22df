#include "viewer_client/imaging/island_pictures.hpp"

#include <gtest/gtest.h>

#include <string>

namespace osteon {
namespace {

constexpr int kSide_px = 8;
// An L from the front, 8 mm wide and 16 mm high. Its foot lies to the left and farther back.
constexpr const char* kL =
    "..#.....\n"
    "..#.....\n"
    "..#.....\n"
    "..#.....\n"
    "..#.....\n"
    "..#.....\n"
    "..#---..\n"
    "..#---..\n";

// x to the patient's left, y to the back, z to the head.
VoxelFile<std::uint8_t> scan_of(const std::array<int, 3>& dims, const Vec3& step_mm) {
  VoxelFile<std::uint8_t> numbers;
  numbers.geometry.dims = dims;
  numbers.geometry.axes_mm = step_mm.asDiagonal();
  numbers.values.assign(numbers.geometry.count(), 0);
  return numbers;
}

void fill(VoxelFile<std::uint8_t>& numbers, std::uint8_t number, const std::array<int, 3>& first,
          const std::array<int, 3>& last) {
  for (int z = first[2]; z <= last[2]; ++z)
    for (int y = first[1]; y <= last[1]; ++y)
      for (int x = first[0]; x <= last[0]; ++x) numbers.values[numbers.index({x, y, z})] = number;
}

// A row of letters for each row of pixels: "#" white, "-" darker, "." nothing.
std::string drawn(const IslandPicture& picture) {
  std::string text;
  for (int row = 0; row < picture.side_px; ++row) {
    for (int column = 0; column < picture.side_px; ++column) {
      const int grey = picture.greys.at(static_cast<std::size_t>(row * picture.side_px + column));
      text += grey == 0 ? '.' : grey == 255 ? '#' : '-';
    }
    text += '\n';
  }
  return text;
}

// Slices are 2 mm.
TEST(IslandPictures, AreSeenFromTheFrontAsLargeAsTheyFit) {
  auto numbers = scan_of({40, 30, 20}, {1.0, 1.0, 2.0});
  fill(numbers, 3, {10, 5, 4}, {11, 5, 11});
  fill(numbers, 3, {12, 9, 4}, {17, 9, 5});
  const auto pictures = island_pictures(numbers, kSide_px);
  EXPECT_EQ(drawn(pictures[3]), kL);
  EXPECT_TRUE(pictures[0].greys.empty());
  EXPECT_TRUE(pictures[2].greys.empty());
}

TEST(IslandPictures, OfAMirroredScanAreThoseOfTheSameBone) {
  auto numbers = scan_of({40, 30, 20}, {-1.0, -1.0, -2.0});
  fill(numbers, 3, {28, 24, 8}, {29, 24, 15});
  fill(numbers, 3, {22, 20, 14}, {27, 20, 15});
  EXPECT_EQ(drawn(island_pictures(numbers, kSide_px)[3]), kL);
}

TEST(IslandPictures, OfOneVoxelFillTheirSquare) {
  auto numbers = scan_of({5, 5, 5}, {1.0, 1.0, 1.0});
  fill(numbers, 255, {4, 4, 4}, {4, 4, 4});
  const auto pictures = island_pictures(numbers, 2);
  EXPECT_EQ(drawn(pictures[255]), "##\n##\n");
}

}  // namespace
}  // namespace osteon
