// Where an item is placed, on bones that are known in closed form.
#include "common/tools/placing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace osteon {
namespace {

// A ball of bone round the origin.
BoneQuery bone_ball(double radius_mm) {
  return [radius_mm](const Vec3& p) { return p.norm() - radius_mm; };
}
// Bone above z = 0 with a hemisphere of this radius reamed into it. +z points into the bone.
BoneQuery bone_with_cup(double radius_mm) {
  return [radius_mm](const Vec3& p) { return std::max(-p.z(), radius_mm - p.norm()); };
}

Standing one(const char* tool, const Pose& pose = {}) {
  Standing result;
  result.tool = *find_tool(tool);
  result.item.id = 7;
  result.item.tool = result.tool.hash();
  result.item.pose_bone_item = pose;
  return result;
}

double between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

TEST(Placing, WithoutAWayTheItemStandsWhereItSays) {
  const Standing guide = one("guide-1", pose_along({1, 2, 3}, {0, 1, 0}));
  const auto stands = placed({}, nullptr, guide, bone_ball(10));
  ASSERT_TRUE(stands);
  EXPECT_TRUE(stands->item == guide.item);
}

TEST(Placing, OntoABallItStandsOnTheRadius) {
  const Vec3 near(8, 9, 12);  // 17 from the middle
  const auto stands = placed(OntoBone{near, {}, Vec3::UnitX()}, nullptr, one("guide-1"), bone_ball(20));
  ASSERT_TRUE(stands) << stands.error().message;
  const Pose& pose = stands->item.pose_bone_item;
  EXPECT_NEAR(pose.position_mm.norm(), 20.0, 1e-3);
  EXPECT_LT(between(pose.position_mm, near), 0.01);
  EXPECT_LT(between(pose.direction(Vec3::UnitZ()), -near), 0.01) << "into the bone";
  // Its x lies in the plane of its z and the given direction across.
  EXPECT_NEAR(pose.direction(Vec3::UnitY()).dot(Vec3::UnitX()), 0.0, 1e-9);
  EXPECT_GT(pose.direction(Vec3::UnitX()).dot(Vec3::UnitX()), 0.0);

  const auto along = placed(OntoBone{near, Vec3(0, 0, -3), Vec3::UnitX()}, nullptr, one("guide-1"), bone_ball(20));
  ASSERT_TRUE(along);
  EXPECT_LT(between(along->item.pose_bone_item.direction(Vec3::UnitZ()), Vec3(0, 0, -1)), 1e-9);
  EXPECT_NEAR(along->item.pose_bone_item.position_mm.norm(), 20.0, 1e-3);

  EXPECT_FALSE(placed(OntoBone{{0, 0, 50}, {}, Vec3::UnitX()}, nullptr, one("guide-1"), bone_ball(20)))
      << "no bone within 20 mm";
}

TEST(Placing, AScrewTurnsByItsThreadUntilItsHeadIsOnBone) {
  Standing screw = one("screw-1");
  screw.item.turns = 2.0;
  const double pitch = screw.tool.thread_pitch_mm, length = screw.tool.cutting_length_mm;
  const auto turned = placed(ByThread{1.25}, &screw, screw, bone_with_cup(1.0));
  ASSERT_TRUE(turned) << turned.error().message;
  EXPECT_DOUBLE_EQ(turned->item.turns, 3.25);
  EXPECT_NEAR(turned->item.pose_bone_item.position_mm.z(), 1.25 * pitch, 1e-9);
  EXPECT_LT(between(turned->item.pose_bone_item.direction(Vec3::UnitX()), Vec3::UnitY()), 1e-9)
      << "a turn and a quarter";

  // Driven home: the underside of its head is one length above the tip.
  const auto home = placed(ByThread{80.0 / pitch}, &screw, screw, bone_with_cup(0.0));
  ASSERT_TRUE(home) << home.error().message;
  EXPECT_NEAR(home->item.pose_bone_item.position_mm.z(), length, 0.01);
  EXPECT_NEAR(home->item.turns - 2.0, length / pitch, 0.01 / pitch);
  EXPECT_TRUE(set_by_rules({}, &screw, {home->item, screw.tool}, bone_with_cup(0.0)))
      << "it moves by its pitch times its turns";

  const auto out = placed(ByThread{-0.5}, &screw, screw, bone_with_cup(0.0));
  ASSERT_TRUE(out);
  EXPECT_NEAR(out->item.pose_bone_item.position_mm.z(), -0.5 * pitch, 1e-9);
}

TEST(Placing, ACupIsDrivenIntoACavityOfItsSize) {
  const Standing cup = one("trial-cup-50", {Vec3(0, 0, -1.0), Eigen::Quaterniond::Identity()});
  const double radius = 0.5 * cup.tool.diameter_mm;
  const auto home = placed(DriveHome{60.0}, &cup, cup, bone_with_cup(radius));
  ASSERT_TRUE(home) << home.error().message;
  // Its pole, the origin, reaches the cavity's pole.
  EXPECT_NEAR(home->item.pose_bone_item.position_mm.z(), radius, 0.1);
  EXPECT_GT(home->contact_fraction, 0.9);
  const auto short_way = placed(DriveHome{5.0}, &cup, cup, bone_with_cup(radius));
  ASSERT_TRUE(short_way);
  EXPECT_NEAR(short_way->item.pose_bone_item.position_mm.z(), 4.0, 1e-9);
  EXPECT_LT(short_way->contact_fraction, 0.5);
}

TEST(Placing, RefusesWhatMakesNoSense) {
  const Standing guide = one("guide-1"), screw = one("screw-1"), cup = one("trial-cup-50");
  const auto refused = [](const Placing& how, const Standing* before, const Standing& wanted) {
    const auto stands = placed(how, before, wanted, bone_ball(10));
    EXPECT_FALSE(stands) << wanted.tool.name;
    if (stands) return;
    EXPECT_EQ(stands.error().code, ErrorCode::invalid_input);
    EXPECT_NE(stands.error().message.find(wanted.tool.name), std::string::npos) << stands.error().message;
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  refused(ByThread{1.0}, &guide, guide);
  refused(ByThread{1.0}, nullptr, screw);
  refused(ByThread{1e9}, &screw, screw);
  refused(ByThread{kNan}, &screw, screw);
  refused(DriveHome{1.0}, &screw, screw);
  refused(DriveHome{1.0}, nullptr, cup);
  refused(DriveHome{0.0}, &cup, cup);
  refused(DriveHome{1e9}, &cup, cup);
  refused(DriveHome{kNan}, &cup, cup);
}

}  // namespace
}  // namespace osteon
