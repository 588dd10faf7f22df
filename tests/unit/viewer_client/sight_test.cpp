#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <utility>

#include "synthetic.hpp"
#include "viewer_client/scene/camera_view.hpp"
#include "viewer_client/scene/surface_scene.hpp"
#include "viewer_client/scene/tool_groups.hpp"
#include "viewer_client/scene/tool_pointer.hpp"

// Rays of sight, what they meet, and the tool that rests there.
namespace osteon {
namespace {

using test::block;
using test::sphere_mesh;

constexpr int kWidth = 640, kHeight = 480;
constexpr double kRadius_mm = 20.0;
// The flat triangles of the sphere lie inside it by the sagitta of half a segment.
const double kFlat_mm = kRadius_mm * (1.0 - std::cos(0.5 * std::numbers::pi / 96));

CameraView from_front() {
  CameraView view;
  view.eye_mm = Vec3(0, -100, 0);
  view.target_mm = Vec3::Zero();
  view.up = Vec3::UnitZ();
  return view;
}

SurfaceScene ball() {
  SurfaceScene scene;
  scene.replace(block({BodyId{0}, 0, {0, 0, 0}}, 1, "ball", sphere_mesh(Vec3::Zero(), kRadius_mm, 0, 96)));
  return scene;
}

SightRay toward(const Vec3& from_mm, const Vec3& to_mm) { return {from_mm, (to_mm - from_mm).normalized()}; }

TEST(SightRay, ThePicturesMiddleLooksAtTheTarget) {
  const CameraView view = from_front();
  const SightRay ray = ray_through(view, kWidth, kHeight, kWidth / 2, kHeight / 2);
  // Half a pixel beside the middle of an even number of pixels.
  const double half_px = std::tan(0.5 * view.view_angle_rad) / kHeight;
  EXPECT_NEAR(ray.direction.dot(Vec3::UnitY()), 1.0, half_px * half_px * 2);
  EXPECT_EQ(ray.from_mm, view.eye_mm);
}

TEST(SightRay, TheUpperEdgeIsHalfTheViewAngleAwayAndRightIsRight) {
  const CameraView view = from_front();
  const SightRay top = ray_through(view, kWidth, kHeight, kWidth / 2, 0);
  const double up_rad = std::atan2(top.direction.z(), top.direction.y());
  EXPECT_NEAR(up_rad, 0.5 * view.view_angle_rad, view.view_angle_rad / kHeight);
  // Seen from the front, the patient's left (+x) is on the picture's right.
  EXPECT_GT(ray_through(view, kWidth, kHeight, kWidth - 1, kHeight / 2).direction.x(), 0.1);
}

TEST(CameraView, TurningAndShiftingKeepTheDistance) {
  const CameraView view = from_front();
  const CameraView turned = orbited(view, 0.5 * std::numbers::pi, 0.0);
  EXPECT_NEAR((turned.eye_mm - turned.target_mm).norm(), 100.0, 1e-9);
  // Dragging the bone to the right shows what was on its left: the eye goes to -x.
  EXPECT_NEAR((turned.eye_mm - Vec3(-100, 0, 0)).norm(), 0.0, 1e-9);
  const CameraView over = orbited(view, 0.0, -0.5 * std::numbers::pi);
  EXPECT_NEAR(std::abs(over.eye_mm.z()), 100.0, 1e-9);
  EXPECT_NEAR((zoomed(view, 0.5).eye_mm - Vec3(0, -50, 0)).norm(), 0.0, 1e-9);
}

TEST(CameraView, WhatIsDraggedStaysUnderThePointer) {
  const CameraView view = from_front();
  const SightRay before = ray_through(view, kWidth, kHeight, 320, 240);
  const CameraView moved = shifted(view, 48.0 / kHeight, 24.0 / kHeight);  // right, up
  const SightRay after = ray_through(moved, kWidth, kHeight, 320 + 48, 240 - 24);
  const auto at_target_plane = [](const SightRay& ray) {
    return Vec3(ray.from_mm - ray.from_mm.y() / ray.direction.y() * ray.direction);
  };
  EXPECT_NEAR((at_target_plane(before) - at_target_plane(after)).norm(), 0.0, 1e-9);
}

TEST(FirstHit, RaysFromAllSidesMeetTheBallAtItsRadius) {
  const SurfaceScene scene = ball();
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200; ++i) {
    const Vec3 from = 60.0 * Vec3(normal(random), normal(random), normal(random)).normalized();
    const Vec3 to = 0.9 * kRadius_mm * Vec3(normal(random), normal(random), normal(random)).normalized();
    const SightRay ray = toward(from, to);
    const auto hit = scene.first_hit(ray.from_mm, ray.direction);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->point_mm.norm(), kRadius_mm, kFlat_mm * 4);
    EXPECT_GT(hit->normal.dot(hit->point_mm.normalized()), 0.99);
    EXPECT_LT(hit->normal.dot(ray.direction), 0.0);
  }
}

TEST(FirstHit, TheNearerOfTwoBodiesIsMet) {
  SurfaceScene scene = ball();
  scene.replace(block({BodyId{3}, 0, {0, 0, 0}}, 1, "near", sphere_mesh(Vec3(0, -40, 0), 5.0, 0)));
  const auto hit = scene.first_hit(Vec3(0, -100, 0), Vec3::UnitY());
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->body, BodyId{3});
  EXPECT_NEAR(hit->point_mm.y(), -45.0, 0.1);
}

TEST(FirstHit, NothingIsMetBesideTheBoneNorFromInsideNorWhenItIsGone) {
  SurfaceScene scene = ball();
  EXPECT_FALSE(scene.first_hit(Vec3(kRadius_mm + 1.0, -100, 0), Vec3::UnitY()));
  EXPECT_FALSE(scene.first_hit(Vec3::Zero(), Vec3::UnitY()));
  EXPECT_FALSE(scene.first_hit(Vec3(0, -100, 0), -Vec3::UnitY()));
  scene.replace(block({BodyId{0}, 0, {0, 0, 0}}, 2, "gone", {}));
  EXPECT_FALSE(scene.first_hit(Vec3(0, -100, 0), Vec3::UnitY()));
}

TEST(MeanNormal, PointsOutOfTheBall) {
  const SurfaceScene scene = ball();
  const Vec3 out = Vec3(1, -2, 0.5).normalized();
  const auto normal = scene.mean_normal(kRadius_mm * out, 3.0);
  ASSERT_TRUE(normal);
  EXPECT_GT(normal->dot(out), 0.999);
  EXPECT_FALSE(scene.mean_normal(Vec3(0, 0, 50), 3.0));
}

class OnBall : public testing::Test {
 protected:
  void SetUp() override { pointer_.take("drill-3.2"); }
  void over(const Vec3& to_mm) { pointer_.move(toward(Vec3(0, -100, 0), to_mm), scene_); }
  Vec3 axis() { return pointer_.input().rotation_bone_tool * Vec3::UnitZ(); }

  SurfaceScene scene_ = ball();
  ToolPointer pointer_;
};

TEST_F(OnBall, TheToolRestsOnTheSurfaceAndPointsIntoTheBone) {
  over(Vec3(6, -10, 3));
  ASSERT_TRUE(pointer_.on_bone());
  const Vec3 at = pointer_.input().target_mm;
  EXPECT_NEAR(at.norm(), kRadius_mm, 4 * kFlat_mm);
  EXPECT_GT(axis().dot(-at.normalized()), 0.999);
  EXPECT_FALSE(pointer_.input().push);
}

TEST_F(OnBall, BesideTheBoneNobodyPushes) {
  over(Vec3(80, 0, 0));
  EXPECT_FALSE(pointer_.on_bone());
  EXPECT_FALSE(pointer_.press());
  EXPECT_FALSE(pointer_.input().push);
}

TEST_F(OnBall, APushKeepsItsAxisAndMovesAcrossIt) {
  over(Vec3(0, -10, 0));
  ASSERT_TRUE(pointer_.press());
  const Vec3 before = axis(), at = pointer_.input().target_mm;
  over(Vec3(8, -20, 0));
  EXPECT_TRUE(pointer_.input().push);
  EXPECT_NEAR((axis() - before).norm(), 0.0, 1e-12);
  const Vec3 by = pointer_.input().target_mm - at;
  EXPECT_NEAR(by.dot(before), 0.0, 1e-9);
  EXPECT_NEAR(by.x(), 8.0, 0.05);
  // Far beside the bone the hand still pushes where it was drawn to; it lets go when the button does.
  pointer_.release();
  EXPECT_FALSE(pointer_.input().push);
}

TEST_F(OnBall, TheWheelSetsThePushWithinItsBounds) {
  pointer_.set_push(10.0);
  pointer_.add_push(5.0);
  EXPECT_DOUBLE_EQ(pointer_.push_n(), 15.0);
  pointer_.add_push(1000.0);
  EXPECT_DOUBLE_EQ(pointer_.push_n(), 40.0);
  pointer_.add_push(-1000.0);
  EXPECT_DOUBLE_EQ(pointer_.push_n(), 1.0);
}

TEST_F(OnBall, AnotherToolHasItsOwnSpeedWearAndLaw) {
  pointer_.take("drill-3.2");
  pointer_.set_spindle_speed(700.0);
  pointer_.set_wear_and_law(2.5, "allotta");
  EXPECT_EQ(pointer_.input().wear, 2.5);
  EXPECT_EQ(pointer_.input().law, "allotta");
  pointer_.take("burr-round-5");
  EXPECT_EQ(pointer_.input().spindle_rpm, 0.0);
  EXPECT_FALSE(pointer_.input().wear);
  EXPECT_EQ(pointer_.input().law, "");
}

TEST_F(OnBall, TurningTiltsTheToolAndRollingKeepsItsAxis) {
  over(Vec3(0, -10, 0));
  const Vec3 straight = axis();
  pointer_.turn(from_front(), 0.3, 0.0);
  EXPECT_NEAR(std::acos(axis().dot(straight)), 0.3, 1e-6);
  const Vec3 tilted = axis(), side = pointer_.input().rotation_bone_tool * Vec3::UnitX();
  pointer_.roll(0.5 * std::numbers::pi);
  EXPECT_NEAR((axis() - tilted).norm(), 0.0, 1e-12);
  EXPECT_NEAR(side.dot(pointer_.input().rotation_bone_tool * Vec3::UnitX()), 0.0, 1e-9);
  // The tilt stays while the tool goes over the bone, and a new tool begins without it.
  over(Vec3(5, -10, 5));
  EXPECT_NEAR(std::acos(axis().dot(-pointer_.input().target_mm.normalized())), 0.3, 0.03);
  pointer_.take("burr-round-5");
  over(Vec3(0, -10, 0));
  EXPECT_GT(axis().dot(straight), 0.9999);
}

// A stick's fastest is 0.4 heights of the picture a second, at the tool's distance from the eye.
TEST_F(OnBall, AStickMovesTheToolAcrossThePicture) {
  const CameraView view = from_front();
  for (const auto& [right, up] : {std::pair(1.0, 0.0), std::pair(0.0, -1.0), std::pair(-0.3, 0.4)}) {
    over(Vec3(0, -10, 0));
    constexpr double kDt_s = 0.05;
    pointer_.slide(view, right, up, kDt_s, scene_);
    const double height_mm = 2.0 * 80.0 * std::tan(0.5 * view.view_angle_rad);
    // The ball bends away by r² / 2R, which the ray's slope turns into less than 0.01 mm.
    EXPECT_NEAR(pointer_.input().target_mm.x(), 0.4 * height_mm * kDt_s * right, 0.02);
    EXPECT_NEAR(pointer_.input().target_mm.z(), 0.4 * height_mm * kDt_s * up, 0.02);
    EXPECT_TRUE(pointer_.on_bone());
  }
}

TEST_F(OnBall, AtAnEdgeTheToolWaitsForTheStick) {
  const CameraView view = from_front();
  over(Vec3(0, -10, 0));
  const auto slide = [&](double right, double time_s) {
    for (double t = 0.0; t < time_s; t += 0.01) pointer_.slide(view, right, 0.0, 0.01, scene_);
  };
  slide(1.0, 5.0);
  EXPECT_TRUE(pointer_.on_bone());
  // Where a ray from 100 mm touches a ball of 20 mm: y = −R² / 100 = −4 mm. A ray that passes within the edge by a
  // step of 0.2 mm meets the ball √(2 R · 0.2 mm) = 2.8 mm before that, of which a fifth is to the side.
  EXPECT_NEAR(pointer_.input().target_mm.x(), std::sqrt(400.0 - 16.0), 0.8);
  // The stick went on by 15 mm at most, so 1 s at 20 mm/s brings the tool back onto the ball.
  slide(-1.0, 1.2);
  EXPECT_LT(pointer_.input().target_mm.x(), 18.0);
  EXPECT_GT(pointer_.input().target_mm.x(), 0.0);
}

TEST(ToolPointer, AStickCrossesAGapAndFindsABoneBesideThePicturesMiddle) {
  SurfaceScene scene;
  scene.replace(block({BodyId{0}, 0, {0, 0, 0}}, 1, "left", sphere_mesh(Vec3(-11, 0, 0), 8.0, 0)));
  scene.replace(block({BodyId{1}, 0, {0, 0, 0}}, 1, "right", sphere_mesh(Vec3(11, 0, 0), 8.0, 0)));
  ToolPointer pointer;
  pointer.take("drill-3.2");
  const CameraView view = from_front();
  pointer.slide(view, 0.0, 0.0, 0.01, scene);
  ASSERT_TRUE(pointer.on_bone());
  const double from_x = pointer.input().target_mm.x(), side = from_x > 0.0 ? -1.0 : 1.0;
  bool left_bone = false;
  for (int i = 0; i < 300 && side * pointer.input().target_mm.x() < 5.0; ++i) {
    pointer.slide(view, side, 0.0, 0.01, scene);
    left_bone = left_bone || !pointer.on_bone();
  }
  EXPECT_GT(side * pointer.input().target_mm.x(), 4.9);
  EXPECT_FALSE(left_bone);
  // Where there is no bone at all, there is nothing to find.
  ToolPointer lost;
  lost.take("drill-3.2");
  lost.slide(view, 1.0, 0.0, 0.01, SurfaceScene());
  EXPECT_FALSE(lost.on_bone());
}

TEST_F(OnBall, WhileTheHandPushesAStickMovesTheToolAcrossItsAxisAtAHandsSpeed) {
  CameraView view = from_front();
  view.eye_mm = Vec3(0, -300, 0);  // 0.4 heights are 60 mm here
  over(Vec3(0, -10, 0));
  ASSERT_TRUE(pointer_.press());
  const Vec3 at = pointer_.input().target_mm, along = axis();
  pointer_.slide(view, 1.0, 0.0, 0.1, scene_);
  const Vec3 by = pointer_.input().target_mm - at;
  EXPECT_NEAR(by.x(), 2.0, 0.01);
  EXPECT_NEAR(by.dot(along), 0.0, 1e-9);
  EXPECT_TRUE(pointer_.pushing());
}

TEST(ToolGroups, EveryBuiltInToolIsInExactlyOneOfEightGroups) {
  std::multiset<std::string> grouped;
  for (const ToolGroup& group : tool_groups())
    for (const std::string& tool : group.tools) {
      grouped.insert(tool);
      const Result<Tool> found = find_tool(tool);
      ASSERT_TRUE(found) << tool;
      EXPECT_TRUE(found->cuts() || !group.held) << tool;
    }
  EXPECT_EQ(tool_groups().size(), 8u);
  EXPECT_EQ(grouped.size(), builtin_tools().size());
  for (const Tool& tool : builtin_tools()) EXPECT_EQ(grouped.count(tool.name), 1u) << tool.name;
}

}  // namespace
}  // namespace osteon
