// Checks in the pixels what a person chooses in the menu View: cube, open bone, stereo.
#include "viewer_client/render/bone_scene.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "picture.hpp"
#include "synthetic.hpp"
#include "viewer_client/render/plan_actors.hpp"
#include "viewer_client/scene/stroke.hpp"

namespace osteon {
namespace {

using test::differing_pixels;
using test::focal_px;
using test::from_front;
using test::kHeight;
using test::kRadius_mm;
using test::kWidth;
using test::on_front;
using test::sphere_mesh;

class ScenePicture : public test::SpherePicture {
 protected:
  [[nodiscard]] BoneScene& scene() { return window_->scene(); }
};

// The colour whose share in the lower right corner differs most from grey.
Vec3 tint_of_marker(const Image& image) {
  Vec3 sum = Vec3::Zero();
  for (int y = kHeight - 48; y < kHeight; ++y)
    for (int x = kWidth - 48; x < kWidth; ++x) {
      const auto& [r, g, b] = image.at(x, y);
      sum += Vec3(r, g, b);
    }
  return sum / (48.0 * 48.0);
}

TEST_F(ScenePicture, TheCubeIsInItsCornerAndTurnsWithTheBone) {
  scene().show_marker(true);
  const Image front = drawn();
  int elsewhere = 0, there = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (front.at(x, y) != bare_.at(x, y)) ++(x >= kWidth - 48 && y >= kHeight - 48 ? there : elsewhere);
  EXPECT_EQ(elsewhere, 0);
  EXPECT_GT(there, 400);
  // Each side has a letter of its own.
  std::vector<Image> sides{front};
  for (const Vec3& from : {Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(-1, 0, 0)}) {
    CameraView view = from_front(100.0);
    view.eye_mm = 100.0 * from;
    scene().look(view);
    sides.push_back(drawn());
  }
  for (std::size_t a = 0; a < sides.size(); ++a)
    for (std::size_t b = a + 1; b < sides.size(); ++b)
      EXPECT_GT(
          (tint_of_marker(sides[a]) - tint_of_marker(sides[b])).norm() + 0.01 * differing_pixels(sides[a], sides[b]),
          0.5)
          << a << ", " << b;
  scene().look(from_front(100.0));
  scene().show_marker(false);
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0);
}

TEST_F(ScenePicture, WhatIsBehindThePlaneIsNotDrawn) {
  scene().clip({{Vec3::Zero(), -Vec3::UnitX()}});
  const Image half = drawn();
  const Image empty = [&] {
    scene().show_region({BodyId{0}, 0, {0, 0, 0}}, {});
    Image image = drawn();
    scene().show_region({BodyId{0}, 0, {0, 0, 0}}, sphere_mesh(Vec3::Zero(), kRadius_mm, 0));
    return image;
  }();
  // Half of the disc is left. Its edge, a column of pixels on each side, may be either.
  const double radius_px = focal_px(from_front(100.0)) * std::tan(std::asin(kRadius_mm / 100.0));
  const double disc = std::numbers::pi * radius_px * radius_px;
  EXPECT_NEAR(differing_pixels(half, empty), 0.5 * disc, 0.03 * disc);
  for (int y = 0; y < kHeight; ++y)
    for (int x = kWidth / 2 + 2; x < kWidth; ++x) ASSERT_EQ(half.at(x, y), empty.at(x, y)) << x << ", " << y;
  // A region that comes later is clipped as well, and all of it is back when the clipping ends.
  EXPECT_EQ(differing_pixels(drawn(), half), 0);
  scene().clip({});
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0);
}

// The front of a hollow sphere is away, so the eye sees the inside of its back.
TEST_F(ScenePicture, AnOpenBoneShowsItsInside) {
  scene().clip({{Vec3::Zero(), Vec3::UnitY()}});
  const Image open = drawn();
  const Vec3 middle = colour(open, kWidth / 2, kHeight / 2);
  EXPECT_GT(middle.sum(), colour(open, 4, 4).sum() + 150.0);
}

// The name of a tool's person, an annotation and the name of a planned axis belong to both eyes.
TEST_F(ScenePicture, EyesSideBySideHaveTheSameNames) {
  CuttingState state;
  state.author = AuthorId{7};
  state.tool_name = "burr-round-5";
  state.pose_bone_tool = state.pose_bone_device = pose_along(Vec3(0, -20, 0), -Vec3::UnitZ());
  scene().show_tools(std::span(&state, 1));
  Annotation label{.id = 2, .author = AuthorId{3}, .kind = AnnotationKind::label, .words = "nerve", .colour = 0x10e040};
  label.points.push_back(in_steps(on_front(-0.2, -0.6)));
  SurgicalPlan plan;
  plan.axes = {{"shaft", Vec3(-10, 0, 0), Vec3::UnitZ()}};
  scene().show_plan(plan);
  scene().look(from_front(160.0));
  const auto differing_in_halves = [&](const Image& both) {
    std::array<int, 2> differing{};
    for (const bool right : {false, true}) {
      scene().look(right ? right_eye(from_front(160.0)) : left_eye(from_front(160.0)));
      const Image eye = drawn();
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth / 2; ++x)
          differing[right ? 1 : 0] += both.at((right ? kWidth / 2 : 0) + x, y) != eye.at(kWidth / 4 + x, y) ? 1 : 0;
    }
    scene().look(from_front(160.0));
    return differing;
  };
  ASSERT_TRUE(scene().set_stereo(StereoMode::side_by_side));
  const Image nameless = drawn();
  scene().show_names({{AuthorId{7}, "Ada"}});
  scene().show_annotations(std::span(&label, 1));
  scene().show_planned(true);
  const Image both = drawn();
  std::array<int, 2> changed{};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) changed[x < kWidth / 2 ? 0 : 1] += both.at(x, y) != nameless.at(x, y) ? 1 : 0;
  EXPECT_GT(changed[0], 500);
  EXPECT_NEAR(changed[1], changed[0], 0.1 * changed[0]);
  ASSERT_TRUE(scene().set_stereo(StereoMode::off));
  for (const int differing : differing_in_halves(both)) EXPECT_LT(differing, 0.2 * changed[0]);
  scene().show_names({});
  scene().show_annotations({});
  scene().show_planned(false);
  scene().show_tools({});
}

TEST_F(ScenePicture, EyesSideBySideAreTwoWholePictures) {
  ASSERT_TRUE(scene().set_stereo(StereoMode::side_by_side));
  const Image both = drawn();
  EXPECT_EQ((scene().camera().eye_mm - from_front(100.0).eye_mm).norm(), 0.0);
  ASSERT_TRUE(scene().set_stereo(StereoMode::off));
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0);
  // A half has the window's height and half of its width, so an eye's picture in the whole window has the same scale.
  for (const bool right : {false, true}) {
    scene().look(right ? right_eye(from_front(100.0)) : left_eye(from_front(100.0)));
    const Image eye = drawn();
    int differing = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth / 2; ++x)
        differing += both.at((right ? kWidth / 2 : 0) + x, y) != eye.at(kWidth / 4 + x, y) ? 1 : 0;
    EXPECT_LE(differing, 40) << right;
  }
}

// The left eye's picture is red, the right eye's is the rest.
TEST_F(ScenePicture, AnAnaglyphHasOneEyeInRedAndTheOtherInTheRest) {
  // Nearer than the target, so that the eyes see it at different places.
  scene().show_region({BodyId{0}, 0, {1, 0, 0}}, sphere_mesh(Vec3(0, -40, 9), 5.0, 0));
  ASSERT_TRUE(scene().set_stereo(StereoMode::anaglyph));
  const Image both = drawn();
  ASSERT_TRUE(scene().set_stereo(StereoMode::off));
  scene().look(left_eye(from_front(100.0)));
  const Image left = drawn();
  scene().look(right_eye(from_front(100.0)));
  const Image right = drawn();
  double red_left = 0, red_right = 0, blue_left = 0, blue_right = 0;
  // VTK desaturates each eye's colours in part, so brightness is compared, and only its place.
  const auto bright = [](const Image& image, int x, int y) { return image.at(x, y)[1] > 110; };
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool red = both.at(x, y)[0] > 110, blue = both.at(x, y)[2] > 110;
      red_left += red != bright(left, x, y) ? 1 : 0;
      red_right += red != bright(right, x, y) ? 1 : 0;
      blue_left += blue != bright(left, x, y) ? 1 : 0;
      blue_right += blue != bright(right, x, y) ? 1 : 0;
    }
  EXPECT_LT(red_left, 0.5 * red_right);
  EXPECT_LT(blue_right, 0.5 * blue_left);
}

TEST_F(ScenePicture, AWindowWithoutQuadBuffersSaysSo) {
  (void)drawn();
  EXPECT_FALSE(scene().set_stereo(StereoMode::quad_buffer));
  EXPECT_EQ(scene().stereo(), StereoMode::off);
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0);
}

// A ball of a structure, half of it in the bone, and an axis through both.
SurgicalPlan plan_with(StructureKind kind, const Vec3& centre_mm) {
  const Mesh ball = sphere_mesh(centre_mm, 5.0, 0);
  SurgicalPlan plan;
  plan.structures = {{"ball", kind, 0.5, {ball.positions_mm, ball.triangles, {}}}};
  return plan;
}

TEST_F(ScenePicture, StructuresAtRiskAreSeenBeforeTheBoneAndFainterBehindIt) {
  const auto changed_at_middle = [&] {
    const Vec3 now = colour(drawn(), kWidth / 2, kHeight / 2);
    return (now - colour(bare_, kWidth / 2, kHeight / 2)).norm();
  };
  scene().show_plan(plan_with(StructureKind::vessel, Vec3(0, -22, 0)));
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0) << "off at first";
  scene().show_risks(true);
  const double before = changed_at_middle();
  EXPECT_GT(before, 60.0);
  // Translucent: the bone's colour still counts.
  const Vec3 over_bone = colour(drawn(), kWidth / 2, kHeight / 2);
  scene().show_region({BodyId{0}, 0, {0, 0, 0}}, {});
  EXPECT_GT((over_bone - colour(drawn(), kWidth / 2, kHeight / 2)).norm(), 20.0);
  scene().show_region({BodyId{0}, 0, {0, 0, 0}}, sphere_mesh(Vec3::Zero(), kRadius_mm, 0));
  scene().show_plan(plan_with(StructureKind::vessel, Vec3(0, 0, 0)));
  const double behind = changed_at_middle();
  EXPECT_GT(behind, 8.0);
  EXPECT_LT(behind, 0.6 * before);
  scene().show_planned(true);
  scene().show_risks(false);
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0) << "a structure is not planned";
}

TEST_F(ScenePicture, APlannedAxisIsALineThroughTheBone) {
  SurgicalPlan plan;
  plan.axes = {{"axis", Vec3(4, 0, 0), Vec3::UnitZ()}};
  scene().show_plan(plan);
  scene().show_planned(true);
  const Image image = drawn();
  const auto [x, y] = seen(Vec3(4, 0, 0));
  int columns = 0;
  for (int i = 0; i < kWidth; ++i) columns += image.at(i, y) != bare_.at(i, y) ? 1 : 0;
  EXPECT_GE(columns, 2);
  EXPECT_LE(columns, 6);
  EXPECT_NE(image.at(x, y), bare_.at(x, y));
  scene().show_planned(false);
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0);
}

TEST_F(ScenePicture, TheNameOfAnAxisIsWrittenAsTheWindowSays) {
  SurgicalPlan plan;
  plan.axes = {{"i", Vec3(4, 0, 0), Vec3::UnitZ()}};
  scene().look(from_front(160.0));
  scene().show_planned(true);
  scene().show_plan(plan);
  const Image as_it_is = drawn();
  scene().name_axes([](const std::string& name) { return "Äußere Achse " + name; });
  scene().show_plan(plan);
  EXPECT_GT(differing_pixels(drawn(), as_it_is), 300);
  scene().name_axes({});
  scene().show_plan(plan);
  EXPECT_EQ(differing_pixels(drawn(), as_it_is), 0);
  scene().show_planned(false);
}

// Viewing the colours as a person without one kind of cones does (Viénot 1999), every two kinds still differ.
TEST(StructureColours, DifferForColourBlindPeople) {
  const auto linear = [](std::uint32_t colour, int shift) { return std::pow((colour >> shift & 255) / 255.0, 2.2); };
  Eigen::Matrix3d to_cones;
  to_cones << 17.8824, 43.5161, 4.11935, 3.45565, 27.1554, 3.86714, 0.0299566, 0.184309, 1.46709;
  Eigen::Matrix3d no_long, no_middle;
  no_long << 0, 2.02344, -2.52581, 0, 1, 0, 0, 0, 1;
  no_middle << 1, 0, 0, 0.494207, 0, 1.24827, 0, 0, 1;
  const StructureKind kinds[] = {StructureKind::nerve,     StructureKind::vessel,      StructureKind::dura,
                                 StructureKind::cartilage, StructureKind::soft_tissue, StructureKind::region};
  for (const Eigen::Matrix3d& eye : {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), no_long, no_middle}) {
    const auto shown = [&](StructureKind kind) {
      const std::uint32_t c = colour_of(kind);
      const Vec3 light = to_cones.inverse() * eye * to_cones * Vec3(linear(c, 16), linear(c, 8), linear(c, 0));
      return Vec3(light.cwiseMax(0.0).array().pow(1.0 / 2.2));
    };
    for (const StructureKind a : kinds)
      for (const StructureKind b : kinds)
        if (a < b) {
          EXPECT_GT((shown(a) - shown(b)).norm(), 0.12) << static_cast<int>(a) << " " << static_cast<int>(b);
        }
  }
}

TEST(Clipping, APointIsDrawnOnTheInnerSideOfAllPlanes) {
  const Clipping wedge{{Vec3(1, 0, 0), Vec3::UnitX()}, {Vec3(0, 2, 0), -Vec3::UnitY()}};
  EXPECT_TRUE(is_drawn({}, Vec3(9, 9, 9)));
  EXPECT_TRUE(is_drawn(wedge, Vec3(1.5, 1.5, 7)));
  EXPECT_FALSE(is_drawn(wedge, Vec3(0.5, 1.5, 7)));
  EXPECT_FALSE(is_drawn(wedge, Vec3(1.5, 2.5, 7)));
}

TEST(Eyes, LookAtOnePointFromBothSides) {
  const CameraView view = from_front(100.0);
  const CameraView left = left_eye(view), right = right_eye(view);
  // Seen from the front, x is to the right. 2 degrees at 100 mm are 3.49 mm.
  EXPECT_NEAR((right.eye_mm - left.eye_mm).x(), 3.49, 0.01);
  EXPECT_NEAR(left.eye_mm.norm(), 100.0, 1e-9);
  EXPECT_EQ(left.target_mm, view.target_mm);
}

}  // namespace
}  // namespace osteon
