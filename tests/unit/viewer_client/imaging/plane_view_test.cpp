#include "viewer_client/imaging/plane_view.hpp"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "viewer_client/imaging/island_map.hpp"

namespace osteon {
namespace {

// Scans as scanners and other programs write them: each axis of the voxels along any side of the patient.
std::vector<ScanGeometry> scans() {
  std::vector<ScanGeometry> all;
  const int orders[][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}};
  for (const auto& order : orders)
    for (int signs = 0; signs < 8; ++signs) {
      ScanGeometry scan;
      scan.dims = {4, 6, 9};
      scan.origin_mm = {-12.0, 30.0, 100.0};
      const double steps_mm[] = {0.5, 0.7, 2.0};
      scan.axes_mm.setZero();
      for (int axis = 0; axis < 3; ++axis)
        scan.axes_mm(order[axis], axis) = (signs >> axis & 1) != 0 ? -steps_mm[axis] : steps_mm[axis];
      all.push_back(scan);
    }
  return all;
}

// LPS.
const std::map<char, Vec3> kSides{{'L', Vec3::UnitX()},  {'R', -Vec3::UnitX()}, {'P', Vec3::UnitY()},
                                  {'A', -Vec3::UnitY()}, {'H', Vec3::UnitZ()},  {'F', -Vec3::UnitZ()}};

TEST(PlaneView, GoesToTheSidesThatItsLettersName) {
  for (const ScanGeometry& scan : scans())
    for (const Plane plane : kPlanes) {
      const PlaneAxes axes = axes_of(scan, plane);
      const EdgeLetters letters = letters_of(axes, scan);
      const auto at = [&](int column, int row, int slice) {
        return centre_of(scan, voxel_at(axes, column, row, slice));
      };
      const Vec3 right = at(1, 0, 0) - at(0, 0, 0), down = at(0, 1, 0) - at(0, 0, 0), on = at(0, 0, 1) - at(0, 0, 0);
      EXPECT_NEAR(right.dot(kSides.at(letters.right.at(0))), axes.right_mm, 1e-12);
      EXPECT_NEAR(right.dot(kSides.at(letters.left.at(0))), -axes.right_mm, 1e-12);
      EXPECT_NEAR(down.dot(kSides.at(letters.bottom.at(0))), axes.down_mm, 1e-12);
      EXPECT_NEAR(down.dot(kSides.at(letters.top.at(0))), -axes.down_mm, 1e-12);
      // Slices count to the left, to the back or to the head.
      EXPECT_GT(on.sum(), 0.0);
    }
}

// The nearest sides of a scan whose gantry is tilted by 20 degrees.
TEST(PlaneView, TakesTheNearestSidesOfAnObliqueScan) {
  ScanGeometry scan;
  scan.dims = {5, 5, 5};
  scan.axes_mm = Eigen::AngleAxisd(0.35, Vec3::UnitX()).toRotationMatrix();
  const PlaneAxes axes = axes_of(scan, Plane::coronal);
  EXPECT_EQ(axes.right, 0);
  EXPECT_EQ(axes.down, 2);
  EXPECT_EQ(axes.through, 1);
  EXPECT_TRUE(axes.flip_down);
  EXPECT_EQ(letters_of(axes, scan), (EdgeLetters{"R", "L", "H", "F"}));
  // Tilted by 30 degrees, the column that goes to the head goes to the front too.
  scan.axes_mm = Eigen::AngleAxisd(0.5236, Vec3::UnitX()).toRotationMatrix();
  EXPECT_EQ(letters_of(axes_of(scan, Plane::coronal), scan), (EdgeLetters{"R", "L", "HA", "FP"}));
}

TEST(PlaneView, FindsAVoxelAgain) {
  for (const ScanGeometry& scan : scans())
    for (const Plane plane : kPlanes) {
      const PlaneAxes axes = axes_of(scan, plane);
      const std::array<int, 3> voxel{3, 1, 7};
      const auto [column, row, slice] = place_in(axes, voxel);
      EXPECT_EQ(voxel_at(axes, column, row, slice), voxel);
      const PlaneFrame frame = fit(axes, 300.0, 200.0);
      const auto [x, y] = pixel_of(axes, frame, column, row);
      EXPECT_EQ(under(axes, frame, x, y), (std::array<int, 2>{column, row}));
    }
}

TEST(PlaneView, HasTheAspectOfTheBody) {
  for (const ScanGeometry& scan : scans())
    for (const Plane plane : kPlanes) {
      const PlaneAxes axes = axes_of(scan, plane);
      const PlaneFrame frame = fit(axes, 300.0, 200.0);
      const double width_mm = axes.columns * axes.right_mm, height_mm = axes.rows * axes.down_mm;
      EXPECT_NEAR(frame.width_px / frame.height_px, width_mm / height_mm, 1e-9);
      // As large as it can be, in the middle.
      EXPECT_TRUE(std::abs(frame.width_px - 300.0) < 1e-9 || std::abs(frame.height_px - 200.0) < 1e-9);
      EXPECT_NEAR(2.0 * frame.left_px + frame.width_px, 300.0, 1e-9);
      EXPECT_NEAR(2.0 * frame.top_px + frame.height_px, 200.0, 1e-9);
    }
}

TEST(PlaneView, TakesTheNearestVoxelBesideItsRectangle) {
  const PlaneAxes axes = axes_of(scans().front(), Plane::axial);
  const PlaneFrame frame = fit(axes, 300.0, 200.0);
  EXPECT_EQ(under(axes, frame, -50.0, 1000.0), (std::array<int, 2>{0, axes.rows - 1}));
  EXPECT_EQ(under(axes, PlaneFrame{}, 10.0, 10.0), (std::array<int, 2>{0, 0}));
}

}  // namespace
}  // namespace osteon
