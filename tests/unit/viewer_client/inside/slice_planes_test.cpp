// Linked planes, against closed forms.
#include "viewer_client/inside/slice_planes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/radiology/c_arm.hpp"
#include "common/tools/tool.hpp"
#include "common/tools/tool_solid.hpp"
#include "viewer_client/imaging/patient_letters.hpp"
#include "viewer_client/inside/slice_point.hpp"

namespace osteon {
namespace {

using radiology::PixelGrid;

constexpr std::array<ImageSize, kSlices> kImages{{{201, 101}, {301, 151}, {101, 101}}};

LinkedSlices slices(SliceAxes axes) {
  LinkedSlices view;
  view.axes = axes;
  view.point_mm = {10, 20, 30};
  view.centre_mm = {1, 2, 3};
  view.rotation = pose_along(Vec3::Zero(), Vec3(1, -2, 0.5)).rotation;
  view.pixel_mm = 0.25;
  view.images = kImages;
  return view;
}

TEST(SlicePlanes, AllGoThroughThePointAndAreCentredOnTheProjectionOfTheMiddle) {
  for (const SliceAxes axes : {SliceAxes::patient, SliceAxes::tool}) {
    const LinkedSlices view = slices(axes);
    const auto planes = planes_of(view);
    for (std::size_t i = 0; i < kSlices; ++i) {
      EXPECT_EQ(planes[i].columns, kImages[i].columns);
      EXPECT_EQ(planes[i].rows, kImages[i].rows);
      EXPECT_NEAR(depth_mm(planes[i], view.point_mm), 0.0, 1e-9);
      const Pixel middle = pixel_at(planes[i], view.centre_mm);
      EXPECT_NEAR(middle.x(), 0.5 * (kImages[i].columns - 1), 1e-9);
      EXPECT_NEAR(middle.y(), 0.5 * (kImages[i].rows - 1), 1e-9);
      // There and back.
      const Pixel at = pixel_at(planes[i], view.point_mm);
      EXPECT_NEAR((planes[i].at(at.x(), at.y()) - view.point_mm).norm(), 0.0, 1e-9);
    }
    for (std::size_t i = 0; i < kSlices; ++i)
      EXPECT_NEAR(normal_of(planes[i]).dot(normal_of(planes[(i + 1) % kSlices])), 0.0, 1e-12);
  }
}

// A point that is moved in one image moves the other two planes along their normals, and not its own.
TEST(SlicePlanes, AMoveInOneImageMovesTheOthersPlanes) {
  LinkedSlices view = slices(SliceAxes::patient);
  const auto before = planes_of(view);
  view.point_mm = before[0].at(100, 40);
  const auto after = planes_of(view);
  EXPECT_NEAR(depth_mm(before[0], after[0].first_mm), 0.0, 1e-9);
  const Vec3 moved = view.point_mm - Vec3(10, 20, 30);
  EXPECT_NEAR(std::abs(depth_mm(before[1], after[1].first_mm)), std::abs(moved.y()), 1e-9) << "coronal: across y";
  EXPECT_NEAR(std::abs(depth_mm(before[2], after[2].first_mm)), std::abs(moved.x()), 1e-9) << "sagittal: across x";
}

TEST(SlicePlanes, LieAsRadiologistsLookAtThem) {
  const auto planes = planes_of(slices(SliceAxes::patient));
  EXPECT_EQ(patient_letters(planes[0].column_mm) + patient_letters(planes[0].row_mm), "LP");
  EXPECT_EQ(patient_letters(planes[1].column_mm) + patient_letters(planes[1].row_mm), "LF");
  EXPECT_EQ(patient_letters(planes[2].column_mm) + patient_letters(planes[2].row_mm), "PF");
}

EdgeLetters letters_of_arm(double orbit_deg, double tilt_deg) {
  radiology::CArm arm;
  arm.orbit_rad = orbit_deg / 180.0 * std::numbers::pi;
  arm.tilt_rad = tilt_deg / 180.0 * std::numbers::pi;
  const radiology::PixelGrid detector = radiology::beam_of(arm)->detector;
  return edge_letters(detector.column_mm, detector.row_mm);
}

// Who looks at the image stands at the detector, and looks towards the tube.
TEST(SlicePlanes, EdgesOfRadiographsNameThePatientsSides) {
  // In front of the patient, eye to eye.
  EXPECT_EQ(letters_of_arm(0, 0), (EdgeLetters{"R", "L", "H", "F"}));
  // Behind the patient.
  EXPECT_EQ(letters_of_arm(180, 0), (EdgeLetters{"L", "R", "H", "F"}));
  // At the patient's left, with the head up: who faces the patient's right has the patient's front at the left hand.
  EXPECT_EQ(letters_of_arm(90, 0), (EdgeLetters{"A", "P", "H", "F"}));
  EXPECT_EQ(letters_of_arm(-90, 0), (EdgeLetters{"P", "A", "H", "F"}));
  // Above the head. On the way there from the front, the eyes turn from the back to the feet. So the top of the image
  // turns from the head to the back, and the sides stay.
  EXPECT_EQ(letters_of_arm(0, 90), (EdgeLetters{"R", "L", "P", "A"}));
  EXPECT_EQ(letters_of_arm(0, -90), (EdgeLetters{"R", "L", "A", "P"}));
  // A third of the way to the patient's left: sin 30° is above sin 22.5°.
  EXPECT_EQ(letters_of_arm(30, 0), (EdgeLetters{"RA", "LP", "H", "F"}));
  EXPECT_EQ(letters_of_arm(0, 30), (EdgeLetters{"R", "L", "HP", "FA"}));
}

TEST(SlicePlanes, ScaleBarsAreRound) {
  EXPECT_DOUBLE_EQ(scale_bar_mm(10.0), 10.0);
  EXPECT_DOUBLE_EQ(scale_bar_mm(9.9), 5.0);
  EXPECT_DOUBLE_EQ(scale_bar_mm(49.0), 20.0);
  EXPECT_DOUBLE_EQ(scale_bar_mm(1.9), 1.0);
  EXPECT_DOUBLE_EQ(scale_bar_mm(0.26), 0.2);
  EXPECT_DOUBLE_EQ(scale_bar_mm(100.0), 100.0);
}

// Pixels of 0.25 mm.
PixelGrid axial_at(double z_mm) {
  return radiology::grid_about({0, 0, z_mm}, Vec3::UnitX(), Vec3::UnitY(), 0.25, 161, 121);
}

double length_px(const std::vector<OutlinePart>& parts) {
  double length = 0.0;
  for (const OutlinePart& part : parts) length += (part.to - part.from).norm();
  return length;
}

TEST(Outline, OfABallIsACircleInAPlaneThroughIt) {
  const PixelGrid plane = axial_at(3.0);
  const auto parts = outline_in(plane, ball({1, 0, 0}, 5.0));
  ASSERT_GT(parts.size(), 20u);
  for (const OutlinePart& part : parts)
    for (const Pixel& end : {part.from, part.to})
      EXPECT_NEAR((plane.at(end.x(), end.y()) - Vec3(1, 0, 3)).norm(), 4.0, 0.0025) << "5² − 3² = 4²; 0.01 pixel";
  EXPECT_NEAR(length_px(parts) * 0.25, 2.0 * std::numbers::pi * 4.0, 0.01 * 25.0);
  EXPECT_TRUE(outline_in(axial_at(5.1), ball({1, 0, 0}, 5.0)).empty());
}

TEST(Outline, OfADrillIsACircleOfItsDiameterAboveItsPoint) {
  const Tool drill = *find_tool("drill-3.2");
  // It points down, with its tip at z = -8.
  const Implicit solid = placed(cutting_part(drill), pose_along({2, 1, -8}, {0, 0, -1}));
  const PixelGrid plane = axial_at(-4.0);
  const auto parts = outline_in(plane, solid);
  ASSERT_GT(parts.size(), 8u);
  for (const OutlinePart& part : parts)
    EXPECT_NEAR((plane.at(part.from.x(), part.from.y()) - Vec3(2, 1, -4)).norm(), 1.6, 0.0025);
}

// A side that is cut by the image's edge is drawn up to the edge.
TEST(Outline, EndsAtTheEdgeOfTheImage) {
  const PixelGrid plane = axial_at(0.0);
  const auto parts = outline_in(plane, cuboid({{-100, -2, -1}, {100, 2, 1}}));
  double least = 1e9, most = -1e9;
  for (const OutlinePart& part : parts)
    for (const Pixel& end : {part.from, part.to}) {
      least = std::min(least, end.x());
      most = std::max(most, end.x());
      EXPECT_NEAR(std::abs(plane.at(end.x(), end.y()).y()), 2.0, 0.0025);
    }
  EXPECT_LE(least, 0.0);
  EXPECT_GE(most, 160.0);
}

TEST(ProjectedLine, GoesThroughThePlaneWhereItSaysSo) {
  const PixelGrid plane = axial_at(3.0);
  // From (0, 0, 0) towards (1, 2, 1): at z = 3 it is at (3, 6).
  const auto line = project(plane, {0, 0, 0}, Vec3(1, 2, 1).normalized());
  ASSERT_TRUE(line && line->through);
  EXPECT_NEAR((plane.at(line->through->x(), line->through->y()) - Vec3(3, 6, 3)).norm(), 0.0, 1e-9);
  // Its projection y = 2 x meets the upper and the lower edge, at y = ∓15.
  const Vec3 from = plane.at(line->from.x(), line->from.y()), to = plane.at(line->to.x(), line->to.y());
  EXPECT_NEAR((from - Vec3(-7.5, -15, 3)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((to - Vec3(7.5, 15, 3)).norm(), 0.0, 1e-9);
}

TEST(ProjectedLine, MayBeParallelOrAcrossOrOutside) {
  const PixelGrid plane = axial_at(3.0);
  const auto parallel = project(plane, {0, 1, 0}, Vec3::UnitX());
  ASSERT_TRUE(parallel);
  EXPECT_FALSE(parallel->through);
  EXPECT_NEAR(std::abs(parallel->to.x() - parallel->from.x()), 160.0, 1e-9);
  const auto across = project(plane, {1, 1, 0}, Vec3::UnitZ());
  ASSERT_TRUE(across && across->through);
  EXPECT_EQ(across->from, across->to);
  EXPECT_NEAR((plane.at(across->from.x(), across->from.y()) - Vec3(1, 1, 3)).norm(), 0.0, 1e-9);
  EXPECT_FALSE(project(plane, {100, 1, 0}, Vec3::UnitZ()));
  EXPECT_FALSE(project(plane, {0, 100, 0}, Vec3::UnitX()));
}

Pose drill_at(double x_mm) { return pose_along({x_mm, 0, 0}, {0, 0, -1}); }

TEST(SlicePoint, FollowsTheTipWhileToolsCut) {
  SlicePoint point;
  point.reset({1, 2, 3});
  point.follow(drill_at(5), false, SliceAxes::patient);
  EXPECT_EQ(point.point_mm(), Vec3(1, 2, 3)) << "it is only held";
  point.follow(drill_at(6), true, SliceAxes::patient);
  EXPECT_EQ(point.point_mm(), Vec3(6, 0, 0));
  point.follow(drill_at(7), false, SliceAxes::patient);
  EXPECT_EQ(point.point_mm(), Vec3(6, 0, 0)) << "where it cut last";
  point.set({9, 9, 9});
  point.follow(drill_at(7), false, SliceAxes::patient);
  EXPECT_EQ(point.point_mm(), Vec3(9, 9, 9));
  point.follow(drill_at(8), true, SliceAxes::patient);
  EXPECT_EQ(point.point_mm(), Vec3(8, 0, 0));
}

TEST(SlicePoint, FollowsAHeldToolAlongItsAxesUntilTheUserSetsIt) {
  SlicePoint point;
  point.follow(drill_at(5), false, SliceAxes::tool);
  EXPECT_EQ(point.point_mm(), Vec3(5, 0, 0));
  EXPECT_NEAR((point.rotation() * Vec3::UnitZ() - Vec3(0, 0, -1)).norm(), 0.0, 1e-12);
  point.set({9, 9, 9});
  point.follow(pose_along({6, 0, 0}, {0, 1, 0}), false, SliceAxes::tool);
  EXPECT_EQ(point.point_mm(), Vec3(9, 9, 9));
  EXPECT_NEAR((point.rotation() * Vec3::UnitZ() - Vec3(0, 1, 0)).norm(), 0.0, 1e-12) << "the axes still turn";
  point.follow(drill_at(7), true, SliceAxes::tool);
  EXPECT_EQ(point.point_mm(), Vec3(7, 0, 0));
}

}  // namespace
}  // namespace osteon
