// What the planes show of strokes and cuts, against what osteon-import makes of them.
#include "viewer_client/imaging/corrected_plane.hpp"

#include <gtest/gtest.h>

#include "server/import/edit_file.hpp"

namespace osteon {
namespace {

// Oblique voxels that are no cubes, so that no axis is like another.
imaging::HuVolume oblique_grid() {
  imaging::HuVolume grid;
  grid.dims = {24, 20, 16};
  grid.spacing_mm = {0.5, 0.7, 1.1};
  grid.origin_mm = {-4.0, 11.0, 7.0};
  grid.directions = Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  return grid;
}

ScanGeometry geometry_of(const imaging::HuVolume& grid) {
  return {grid.dims, grid.origin_mm, grid.directions * grid.spacing_mm.asDiagonal()};
}

// All voxels with a column below half are island 1, and the others island 2.
IslandMap halves(const ScanGeometry& scan) {
  VoxelFile<std::uint8_t> numbers{scan, {}};
  for (std::size_t i = 0; i < scan.count(); ++i)
    numbers.values.push_back(static_cast<int>(i) % scan.dims[0] < scan.dims[0] / 2 ? 1 : 2);
  return *IslandMap::make(scan, std::move(numbers));
}

// Two roads to one answer: the window draws each voxel as the importer decides it.
TEST(CorrectedPlane, EachVoxelIsAsTheImporterMakesIt) {
  const imaging::HuVolume grid = oblique_grid();
  const ScanGeometry scan = geometry_of(grid);
  const auto at = [&](double x, double y, double z) { return grid.position_mm(Vec3(x, y, z)); };
  ImagingEdits edits;
  const auto add = [&](Correction correction) {
    edits.corrections.push_back(std::make_shared<const Correction>(std::move(correction)));
  };
  add({CorrectionKind::erase, 0, {at(3, 3, 3), at(18, 12, 9)}, 1.3, Vec3::Zero()});
  add({CorrectionKind::paint, 9, {at(18, 5, 8)}, 2.0, Vec3::Zero()});
  add({CorrectionKind::paint, 8, {at(4, 15, 10), at(20, 15, 10), at(20, 3, 10)}, 1.5, grid.directions.col(2)});
  add({CorrectionKind::cut, 1, {at(6, 6, 6)}, 0.0, Vec3(0.6, 0.8, 0.0)});
  add({CorrectionKind::erase, 0, {at(20, 15, 10)}, 2.0, grid.directions.col(1)});
  add({CorrectionKind::cut, 8, {at(10, 15, 10)}, 0.0, -grid.directions.col(0)});

  // Island 1 is bone 1, and island 2 is left out.
  const IslandMap islands = halves(scan);
  BonesOfIslands bones{};
  bones[1].set(1);
  imaging::VoxelMask labels(grid.dims);
  for (std::size_t i = 0; i < labels.values.size(); ++i)
    labels.values[i] = static_cast<int>(i) % grid.dims[0] < grid.dims[0] / 2 ? 1 : 0;
  const imaging::VoxelMask before = labels;
  const auto list = import::parse_edits(edit_list_text(edits), "edits.yaml");
  ASSERT_TRUE(list) << list.error().message;
  const auto applied = import::apply_edits(grid, *list, labels, [](double) { return true; });
  ASSERT_TRUE(applied) << applied.error().message;

  std::array<int, 3> seen{};  // untouched, painted, erased
  for (const Plane plane : kPlanes) {
    const PlaneAxes axes = axes_of(scan, plane);
    for (int slice = 0; slice < axes.slices; ++slice) {
      const auto marks = corrected_plane(scan, islands, bones, axes, slice, edits.corrections);
      ASSERT_EQ(marks.size(), static_cast<std::size_t>(axes.columns) * static_cast<std::size_t>(axes.rows));
      for (int row = 0; row < axes.rows; ++row)
        for (int column = 0; column < axes.columns; ++column) {
          const auto [i, j, k] = voxel_at(axes, column, row, slice);
          const int mark = marks[static_cast<std::size_t>(row * axes.columns + column)];
          const int shown = mark == 0 ? before.at(i, j, k) : mark == kErased ? 0 : mark;
          ASSERT_EQ(shown, labels.at(i, j, k)) << i << " " << j << " " << k;
          const auto under = bones_at(scan, islands, bones, {i, j, k}, edits.corrections);
          ASSERT_EQ(under.count(), shown == 0 ? 0u : 1u);
          ASSERT_EQ(under.test(static_cast<std::size_t>(shown)), shown != 0);
          ++seen[mark == 0 ? 0 : mark == kErased ? 2 : 1];
        }
    }
  }
  for (const int count : seen) EXPECT_GT(count, 100);
}

TEST(CorrectedPlane, AllBonesOfAnIslandAreUnderAVoxelThatNobodyCorrected) {
  const ScanGeometry scan = geometry_of(oblique_grid());
  BonesOfIslands bones{};
  bones[2].set(3).set(7);
  EXPECT_EQ(bones_at(scan, halves(scan), bones, {20, 5, 5}, {}), bones[2]);
  EXPECT_TRUE(bones_at(scan, halves(scan), bones, {2, 5, 5}, {}).none());
}

TEST(CorrectedPlane, WithoutCorrectionsThereAreNoMarks) {
  const ScanGeometry scan = geometry_of(oblique_grid());
  EXPECT_TRUE(corrected_plane(scan, {}, {}, axes_of(scan, Plane::axial), 0, {}).empty());
}

TEST(CorrectedPlane, ARangeHasTheVoxelsOfABox) {
  const imaging::HuVolume grid = oblique_grid();
  const ScanGeometry scan = geometry_of(grid);
  EXPECT_EQ(range_of(scan, {}), (VoxelRange{{0, 0, 0}, {23, 19, 15}}));
  const MarkedBox box{grid.position_mm(Vec3(20, 3, 9)), grid.position_mm(Vec3(4, 11, 2))};
  const VoxelRange range = range_of(scan, box);
  EXPECT_EQ(range, (VoxelRange{{4, 3, 2}, {20, 11, 9}}));
  EXPECT_TRUE(range.contains({4, 11, 9}));
  EXPECT_FALSE(range.contains({3, 11, 9}));
  // The importer takes the same.
  const auto boxed = import::boxed_voxels(
      grid,
      std::vector{import::LabelEdit{.kind = import::EditKind::box, .points_mm = {box.corner_mm, box.opposite_mm}}});
  ASSERT_TRUE(boxed && *boxed);
  EXPECT_EQ((*boxed)->first, range.first);
  EXPECT_EQ((*boxed)->last, range.last);
}

}  // namespace
}  // namespace osteon
