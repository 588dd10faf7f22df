// The surface of a label as a solid: closed, outwards, around as much as its voxels.
#include "common/surface/label_surface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace osteon {
namespace {

VoxelGrid grid_of(const std::array<int, 3>& dims, const Vec3& steps_mm) {
  VoxelGrid grid;
  grid.dims = dims;
  grid.axes_mm = steps_mm.asDiagonal();
  return grid;
}

template <class Inside>
ReadSlice reads(const VoxelGrid& grid, Inside inside) {
  return [&grid, inside](int k, std::span<std::uint8_t> voxels) {
    std::size_t to = 0;
    for (int j = 0; j < grid.dims[1]; ++j)
      for (int i = 0; i < grid.dims[0]; ++i) voxels[to++] = inside(i, j, k) ? 1 : 0;
  };
}

TEST(LabelSurface, IsClosedAndOutwardsForAnyDirectionOfSlices) {
  for (const double slice_mm : {0.7, -0.7}) {
    const VoxelGrid grid = grid_of({30, 30, 30}, {0.5, 0.6, slice_mm});
    // Reaches the grid's end on one side.
    const auto surface = label_surface(
        grid,
        reads(grid, [](int i, int j, int k) { return std::hypot(i - 12.0, std::hypot(j - 15.0, k - 6.0)) < 10.3; }),
        100'000);
    ASSERT_TRUE(surface);
    EXPECT_EQ(open_edges(*surface), 0u);
    int voxels = 0;
    for (int i = 0; i < 30; ++i)
      for (int j = 0; j < 30; ++j)
        for (int k = 0; k < 30; ++k) voxels += std::hypot(i - 12.0, std::hypot(j - 15.0, k - 6.0)) < 10.3 ? 1 : 0;
    EXPECT_NEAR(enclosed_mm3(*surface) / (voxels * 0.5 * 0.6 * 0.7), 1.0, 0.02);
  }
}

// Steps of voxels would make the area of a ball half as large again.
TEST(LabelSurface, HasNoStepsOfVoxels) {
  const VoxelGrid grid = grid_of({41, 41, 41}, {1, 1, 1});
  const auto surface = label_surface(
      grid,
      reads(grid, [](int i, int j, int k) { return std::hypot(i - 20.0, std::hypot(j - 20.0, k - 20.0)) < 15.0; }),
      100'000);
  ASSERT_TRUE(surface);
  EXPECT_NEAR(area_mm2(*surface) / (4.0 * std::numbers::pi * 15.0 * 15.0), 1.0, 0.04);
}

TEST(LabelSurface, OneVoxelIsASolidAndNoneIsNothing) {
  const VoxelGrid grid = grid_of({1, 1, 1}, {1, 1, 1});
  const auto one = label_surface(grid, reads(grid, [](int, int, int) { return true; }), 100);
  ASSERT_TRUE(one);
  EXPECT_EQ(open_edges(*one), 0u);
  EXPECT_GT(enclosed_mm3(*one), 0.0);
  const auto none = label_surface(grid, reads(grid, [](int, int, int) { return false; }), 100);
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->triangles.empty());
  EXPECT_EQ(label_surface(grid, reads(grid, [](int, int, int) { return true; }), 3).error().code, ErrorCode::exhausted);
}

}  // namespace
}  // namespace osteon
