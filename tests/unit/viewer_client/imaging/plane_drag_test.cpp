#include "viewer_client/imaging/plane_drag.hpp"

#include <gtest/gtest.h>

#include "viewer_client/imaging/island_map.hpp"

namespace osteon {
namespace {

using Voxel = std::array<int, 3>;

// Columns go to the left of the patient, rows to the back, slices to the head: on the screen the axial plane goes right
// and down with them.
ScanGeometry straight() {
  ScanGeometry scan;
  scan.dims = {40, 30, 20};
  scan.axes_mm.diagonal() = Vec3(0.5, 1.0, 2.0);
  return scan;
}

PlaneDrag dragged_over(ImagingTool tool, Plane plane, const std::vector<Voxel>& voxels) {
  PlaneDrag drag(tool, axes_of(straight(), plane), voxels.front());
  for (const Voxel& voxel : voxels) drag.move(voxel);
  return drag;
}

TEST(PlaneDrag, AStrokeKeepsItsCornersOnly) {
  const PlaneDrag drag = dragged_over(ImagingTool::paint, Plane::axial,
                                      {{2, 2, 5}, {3, 2, 5}, {4, 2, 5}, {9, 2, 5}, {9, 4, 5}, {9, 8, 5}, {9, 6, 5}});
  const Correction stroke = drag.stroke(straight(), 7, 1.5, false);
  EXPECT_EQ(stroke.kind, CorrectionKind::paint);
  EXPECT_EQ(stroke.bone, 7);
  EXPECT_EQ(stroke.radius_mm, 1.5);
  EXPECT_EQ(stroke.normal, Vec3::Zero());
  // The way back is a corner.
  EXPECT_EQ(stroke.points_mm, (std::vector<Vec3>{{1, 2, 10}, {4.5, 2, 10}, {4.5, 8, 10}, {4.5, 6, 10}}));
}

TEST(PlaneDrag, AFlatStrokeHasTheNormalOfItsSlice) {
  for (const auto& [plane, normal] : {std::pair{Plane::axial, Vec3(0, 0, 1)}, std::pair{Plane::coronal, Vec3(0, 1, 0)},
                                      std::pair{Plane::sagittal, Vec3(1, 0, 0)}}) {
    const Correction stroke = dragged_over(ImagingTool::erase, plane, {{2, 2, 5}}).stroke(straight(), 7, 1.0, true);
    EXPECT_EQ(stroke.kind, CorrectionKind::erase);
    EXPECT_EQ(stroke.bone, 0) << "an eraser takes any bone";
    EXPECT_EQ(stroke.normal, normal);
  }
}

// Upwards on the screen is to the patient's front, and its right side is the patient's left: +x.
TEST(PlaneDrag, ACutTakesWhatIsToTheRightOfTheDrag) {
  const auto up = dragged_over(ImagingTool::cut, Plane::axial, {{10, 20, 5}, {10, 4, 5}}).cut(straight(), 2);
  ASSERT_TRUE(up);
  EXPECT_EQ(up->kind, CorrectionKind::cut);
  EXPECT_EQ(up->bone, 2);
  EXPECT_NEAR((up->normal - Vec3(1, 0, 0)).norm(), 0.0, 1e-12);
  EXPECT_EQ(up->points_mm, (std::vector<Vec3>{{5, 20, 10}}));
  // Downwards in the coronal plane is to the feet. Its right side is the left of the screen, the patient's right.
  const auto down = dragged_over(ImagingTool::cut, Plane::coronal, {{10, 7, 15}, {10, 7, 3}}).cut(straight(), 1);
  ASSERT_TRUE(down);
  EXPECT_NEAR((down->normal - Vec3(-1, 0, 0)).norm(), 0.0, 1e-12);
  // Both ends lie in the plane, whatever the spacing.
  const auto oblique = dragged_over(ImagingTool::cut, Plane::sagittal, {{10, 3, 15}, {10, 22, 4}}).cut(straight(), 1);
  ASSERT_TRUE(oblique);
  const Vec3 along = centre_of(straight(), {10, 22, 4}) - centre_of(straight(), {10, 3, 15});
  EXPECT_NEAR(oblique->normal.dot(along), 0.0, 1e-12);
  EXPECT_NEAR(oblique->normal.x(), 0.0, 1e-12);
  EXPECT_FALSE(dragged_over(ImagingTool::cut, Plane::axial, {{10, 20, 5}}).cut(straight(), 2));
}

TEST(PlaneDrag, TwoPlanesMakeABox) {
  const ScanGeometry scan = straight();
  const auto flat = dragged_over(ImagingTool::box, Plane::axial, {{30, 4, 5}, {10, 20, 5}}).box(scan, {});
  ASSERT_TRUE(flat);
  EXPECT_EQ(flat->corner_mm, centre_of(scan, {10, 4, 0}));
  EXPECT_EQ(flat->opposite_mm, centre_of(scan, {30, 20, 19}));
  const auto box = dragged_over(ImagingTool::box, Plane::coronal, {{12, 9, 3}, {28, 9, 16}}).box(scan, flat);
  ASSERT_TRUE(box);
  EXPECT_EQ(box->corner_mm, centre_of(scan, {12, 4, 3}));
  EXPECT_EQ(box->opposite_mm, centre_of(scan, {28, 20, 16}));
  EXPECT_FALSE(dragged_over(ImagingTool::box, Plane::axial, {{30, 4, 5}}).box(scan, box)) << "a click takes it away";
  EXPECT_FALSE(dragged_over(ImagingTool::box, Plane::axial, {{0, 0, 5}, {39, 29, 5}}).box(scan, {}));
}

}  // namespace
}  // namespace osteon
