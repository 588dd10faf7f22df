// Guides, pins, screws and trial implants on bones that are known in closed form.
#include "common/tools/scene.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace osteon {
namespace {

using std::numbers::pi;

// A slab below z = 0. +z points into it.
double slab(const Vec3& p) { return -p.z(); }

// The slab with a hemisphere of this radius reamed into it, its centre on the surface.
BoneQuery reamed(double radius_mm) {
  return [radius_mm](const Vec3& p) { return std::max(-p.z(), radius_mm - p.norm()); };
}

Tool cup(double diameter_mm) {
  Tool tool = *find_tool("trial-cup-50");
  tool.diameter_mm = diameter_mm;
  return tool;
}

// The cup starts with its pole at the surface.
Seating driven(double cup_mm, double cavity_mm) {
  const Result<Seating> seating =
      drive_home(cup(cup_mm), {Vec3(0, 0, -1.0), Eigen::Quaterniond::Identity()}, 60.0, reamed(0.5 * cavity_mm));
  EXPECT_TRUE(seating.has_value());
  return *seating;
}

Standing standing(const Tool& tool, const Pose& pose, std::uint32_t id = 0) {
  Standing result;
  result.tool = tool;
  result.item.id = id;
  result.item.tool = tool.hash();
  result.item.pose_bone_item = pose;
  return result;
}

TEST(SceneItem, EveryFieldCounts) {
  SceneItem a;
  a.id = 3;
  SceneItem b = a;
  EXPECT_TRUE(a == b);
  b.turns = 0.5;
  EXPECT_FALSE(a == b);
  b = a;
  b.pose_bone_item.position_mm.x() = 1e-9;
  EXPECT_FALSE(a == b);
  b = a;
  b.set_at = 1;
  EXPECT_FALSE(a == b);
}

TEST(SetByRules, LeavesOnTheBoneOnlyWhatStandsThere) {
  for (const Tool& tool : builtin_tools()) {
    const bool stands = !tool.cuts() || tool.kind == ToolKind::pin || tool.kind == ToolKind::screw;
    EXPECT_EQ(set_by_rules({}, nullptr, standing(tool, Pose{}), {}).has_value(), stands) << tool.name;
  }
}

TEST(PlaceOnBone, FindsTheNearestPointAndItsNormal) {
  const BoneQuery ball = [](const Vec3& p) { return std::clamp((p - Vec3(5, -3, 2)).norm() - 20.0, -2.0, 2.0); };
  for (const Vec3& out : {Vec3(1, 0.2, -0.4), Vec3(-0.3, 0.9, 0.8), Vec3(0, 0, 1)})
    for (const double r : {14.0, 19.0, 24.0, 33.0}) {
      const auto place = nearest_surface(ball, Vec3(5, -3, 2) + r * out.normalized());
      ASSERT_TRUE(place);
      EXPECT_LT((place->point_mm - Vec3(5, -3, 2) - 20.0 * out.normalized()).norm(), 0.02) << r;
      EXPECT_GT(place->outward.dot(out.normalized()), 0.9999);
      const Result<Pose> pose =
          place_on_bone(ball, Vec3(5, -3, 2) + r * out.normalized(), std::nullopt, Vec3(0, 1, 0.1));
      ASSERT_TRUE(pose.has_value());
      EXPECT_GT(pose->direction(Vec3::UnitZ()).dot(-out.normalized()), 0.9999);
      // x lies in the plane of axis and `across`.
      EXPECT_NEAR(pose->direction(Vec3::UnitY()).dot(Vec3(0, 1, 0.1)), 0.0, 1e-9);
    }
  EXPECT_FALSE(place_on_bone(ball, Vec3(80, 0, 0), std::nullopt, Vec3::UnitX()).has_value());
  const Result<Pose> given = place_on_bone(slab, Vec3(1, 2, -4), Vec3(0.3, 0, 1), Vec3::UnitX());
  EXPECT_LT((given->position_mm - Vec3(1, 2, 0)).norm(), 0.02);
  EXPECT_GT(given->direction(Vec3::UnitZ()).dot(Vec3(0.3, 0, 1).normalized()), 1.0 - 1e-12);
}

// Two pins through the block's holes fix it. One pin does not, nor do two through the same hole or beside it.
TEST(Pins, TwoFixAGuide) {
  const Tool block = *find_tool("guide-2"), pin = *find_tool("pin-1");
  const Pose place{{10, 5, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Vec3::UnitZ()))};
  const GuideShape shape = guide_shape(block);
  const auto pin_in = [&](std::size_t hole, double beyond_mm, double aside_mm = 0.0) {
    const GuideBore& bore = shape.pin_holes[hole];
    return standing(pin,
                    place * Pose{bore.entry_mm + (bore.length_mm + beyond_mm) * bore.direction + Vec3(0, aside_mm, 0),
                                 Eigen::Quaterniond::Identity()});
  };
  EXPECT_EQ(pins_in(block, place, {}), 0);
  std::vector<Standing> scene{pin_in(0, 20.0)};
  EXPECT_EQ(pins_in(block, place, scene), 1);
  scene.push_back(pin_in(0, 25.0));
  EXPECT_EQ(pins_in(block, place, scene), 1);
  scene[1] = pin_in(1, 20.0, 1.0);
  EXPECT_EQ(pins_in(block, place, scene), 1);
  scene[1] = pin_in(1, -3.0);  // has not come through
  EXPECT_EQ(pins_in(block, place, scene), 1);

  const Standing before = standing(block, place, 1);
  Standing moved = before;
  moved.item.pose_bone_item.position_mm.x() += 2.0;
  EXPECT_TRUE(set_by_rules(scene, &before, moved, slab).has_value());
  EXPECT_FALSE(set_by_rules(scene, &before, before, slab)->seated);
  scene[1] = pin_in(1, 20.0);
  EXPECT_EQ(pins_in(block, place, scene), 2);
  EXPECT_TRUE(set_by_rules(scene, &before, before, slab)->seated);
  const auto refused = set_by_rules(scene, &before, moved, slab);
  ASSERT_FALSE(refused.has_value());
  EXPECT_NE(refused.error().message.find("draw a pin"), std::string::npos);
}

TEST(Pins, MoveAlongTheirAxisOnly) {
  const Standing before =
      standing(*find_tool("pin-1"), {{0, 0, 10}, Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vec3::UnitX()))}, 4);
  Standing wanted = before;
  wanted.item.pose_bone_item =
      before.item.pose_bone_item * Pose{{0, 0, 7}, Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Vec3::UnitZ()))};
  EXPECT_TRUE(set_by_rules({}, &before, wanted, slab).has_value());
  wanted.item.pose_bone_item = before.item.pose_bone_item * Pose{{0.5, 0, 7}, Eigen::Quaterniond::Identity()};
  EXPECT_FALSE(set_by_rules({}, &before, wanted, slab).has_value());
  wanted.item.pose_bone_item =
      before.item.pose_bone_item * Pose{{0, 0, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Vec3::UnitX()))};
  EXPECT_FALSE(set_by_rules({}, &before, wanted, slab).has_value());
  wanted = standing(*find_tool("pin-2"), before.item.pose_bone_item, 4);
  EXPECT_FALSE(set_by_rules({}, &before, wanted, slab).has_value());
}

// One pitch per turn, in both directions, until the head is on the bone: thread length below the surface.
TEST(Screw, FollowsItsThreadAndStopsAtItsHead) {
  const Tool screw = *find_tool("screw-1");
  const Pose start{{3, 4, 2.0}, Eigen::Quaterniond::Identity()};
  const Driven in = turn_screw(screw, start, 8.25, slab);
  EXPECT_NEAR(in.turns, 8.25, 1e-12);
  EXPECT_FALSE(in.seated);
  EXPECT_NEAR(in.pose_bone_item.position_mm.z(), 2.0 + 8.25 * screw.thread_pitch_mm, 1e-9);
  // A quarter turn after eight turns.
  EXPECT_NEAR(in.pose_bone_item.direction(Vec3::UnitX()).dot(Vec3::UnitY()), 1.0, 1e-9);
  const Driven out = turn_screw(screw, in.pose_bone_item, -8.25, slab);
  EXPECT_LT((out.pose_bone_item.position_mm - start.position_mm).norm(), 1e-9);
  EXPECT_LT(out.pose_bone_item.rotation.angularDistance(start.rotation), 1e-6);

  const Driven home = turn_screw(screw, start, 1000.0, slab);
  EXPECT_TRUE(home.seated);
  EXPECT_NEAR(home.pose_bone_item.position_mm.z(), screw.cutting_length_mm, 1e-6);
  EXPECT_NEAR(home.turns, (screw.cutting_length_mm - 2.0) / screw.thread_pitch_mm, 1e-6);
  EXPECT_NEAR(turn_screw(screw, home.pose_bone_item, 1.0, slab).turns, 0.0, 1e-6);
  EXPECT_FALSE(turn_screw(screw, home.pose_bone_item, -1.0, slab).seated);
  // When tilted, one side of the head meets the bone first: by radius times the slope's sine along the axis over its
  // cosine.
  const double tilt = 0.2;
  const Pose leaning{{0, 0, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(tilt, Vec3::UnitX()))};
  const Driven leant = turn_screw(screw, leaning, 1000.0, slab);
  const double along = leant.turns * screw.thread_pitch_mm;
  EXPECT_NEAR((along - screw.cutting_length_mm) * std::cos(tilt) + 0.5 * screw.shank_diameter_mm * std::sin(tilt), 0.0,
              0.02);

  Standing before = standing(screw, start, 2), wanted = before;
  wanted.item.pose_bone_item = home.pose_bone_item;
  wanted.item.turns = home.turns;
  ASSERT_TRUE(set_by_rules({}, &before, wanted, slab).has_value());
  EXPECT_TRUE(set_by_rules({}, &before, wanted, slab)->seated);
  wanted.item.turns -= 1.0;
  EXPECT_FALSE(set_by_rules({}, &before, wanted, slab).has_value());
}

// A cup of 50 mm in a hemisphere of 50: everything touches, and its rim is level with the bone.
TEST(TrialCup, FillsItsOwnHemisphere) {
  const Seating seating = driven(50, 50);
  std::printf("  50 in 50: pole at %.3f mm, contact %.3f, gap %.3f, overlap %.3f mm\n",
              seating.pose_bone_item.position_mm.z(), seating.fit.contact_fraction, seating.fit.largest_gap_mm,
              seating.fit.largest_overlap_mm);
  EXPECT_TRUE(seating.seated);
  EXPECT_NEAR(seating.pose_bone_item.position_mm.z(), 25.0, 0.1);
  EXPECT_GT(seating.fit.contact_fraction, 0.98);
  EXPECT_LT(seating.fit.largest_gap_mm, 0.2);
  EXPECT_LE(seating.fit.largest_overlap_mm, 0.02 + 1e-6);
}

// In a hemisphere of 52 it lies on its pole, 1 mm deeper than centred. The gap at polar angle t is 26 − √(25² + 1
// + 50 cos t). The gap is within 0.2 mm for the share 1 − cos t of the hemisphere.
TEST(TrialCup, IsLooseInALargerOne) {
  const Seating seating = driven(50, 52);
  std::printf("  50 in 52: pole at %.3f mm, contact %.3f, gap %.3f, overlap %.3f mm\n",
              seating.pose_bone_item.position_mm.z(), seating.fit.contact_fraction, seating.fit.largest_gap_mm,
              seating.fit.largest_overlap_mm);
  EXPECT_TRUE(seating.stopped);
  EXPECT_FALSE(seating.seated);
  EXPECT_NEAR(seating.pose_bone_item.position_mm.z(), 26.0, 0.05);
  EXPECT_NEAR(seating.fit.largest_gap_mm, 26.0 - std::sqrt(626.0), 0.06);
  const double share = 1.0 - ((26.0 - 0.2) * (26.0 - 0.2) - 626.0) / 50.0;
  EXPECT_NEAR(seating.fit.contact_fraction, share, 0.04);
}

// In a hemisphere of 48 it hangs on the rim. A sphere of 25 mm meets the mouth of radius 24 at √(25² − 24²) = 7
// mm below its middle. So its pole is at 18 mm, 6 mm above the cavity's, and its rim stands 7 mm above the bone.
TEST(TrialCup, StandsProudInASmallerOne) {
  const Seating seating = driven(50, 48);
  std::printf("  50 in 48: pole at %.3f mm, contact %.3f, gap %.3f, overlap %.3f mm\n",
              seating.pose_bone_item.position_mm.z(), seating.fit.contact_fraction, seating.fit.largest_gap_mm,
              seating.fit.largest_overlap_mm);
  EXPECT_TRUE(seating.stopped);
  EXPECT_FALSE(seating.seated);
  EXPECT_NEAR(seating.pose_bone_item.position_mm.z(), 18.0, 0.3);
  EXPECT_NEAR(seating.fit.largest_gap_mm, 7.0, 0.3);
  EXPECT_LE(seating.fit.largest_overlap_mm, 0.02 + 1e-6);
  EXPECT_LT(seating.fit.contact_fraction, 0.2);
}

TEST(TrialCup, SaysWhenItCannotStart) {
  const auto none = drive_home(cup(50), {Vec3(0, 0, 5), Eigen::Quaterniond::Identity()}, 10.0, slab);
  ASSERT_FALSE(none.has_value());
  EXPECT_NE(none.error().message.find("draw it back"), std::string::npos);
  EXPECT_FALSE(drive_home(cup(50), {Vec3(0, 0, -20), Eigen::Quaterniond::Identity()}, 10.0, slab)->stopped);
}

}  // namespace
}  // namespace osteon
