// Bones at poses in one frame: what a joint says at a point is what the bone says at that point in its own frame.
#include "common/phantoms/joint.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "common/phantoms/femur.hpp"
#include "common/phantoms/tibia.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/phantoms/made_bones.hpp"

namespace osteon::phantoms {
namespace {

Pose some_pose() {
  Pose pose;
  pose.position_mm = {31.0, -44.0, 12.0};
  pose.rotation = Eigen::AngleAxisd(0.7, Vec3(0.2, -0.5, 0.9).normalized());
  return pose;
}

JointMember member(const char* name, const char* kind, const Pose& pose = {}, std::optional<Cut> cut = {}) {
  return {name, bone_of({.kind = kind}), pose, cut};
}

template <class... Members>
Joint joint_of(Members... members) {
  std::vector<JointMember> all;
  (all.push_back(std::move(members)), ...);
  return Joint(std::move(all), {});
}

Vec3 point_in(const Box& box, test::Random& random) {
  return {random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
          random.between(box.min_mm.z(), box.max_mm.z())};
}

TEST(Joint, AMovedBoneIsTheBoneAtMovedPoints) {
  const auto bone = bone_of({.kind = "tibia"});
  const Joint joint = joint_of(member("tibia", "tibia", some_pose()));
  test::Random random(5);
  for (int i = 0; i < 3000; ++i) {
    const Vec3 at = point_in(bone->bounds(), random), moved = some_pose().point(at);
    const BoneDepths own = bone->depths(at), found = joint.depths(moved);
    EXPECT_NEAR(found.surface_mm, own.surface_mm, 1e-9);
    EXPECT_NEAR(found.cortex_mm, own.cortex_mm, 1e-9);
    EXPECT_NEAR(found.marrow_mm, own.marrow_mm, 1e-9);
    EXPECT_EQ(found.bone, own.bone);
    EXPECT_NEAR(joint.density_g_cm3(moved, 0.5), bone->density_g_cm3(at, 0.5), 1e-6);
    if (own.surface_mm < 0.0) {
      const Box box = joint.bounds();
      EXPECT_TRUE((moved.array() >= box.min_mm.array()).all() && (moved.array() <= box.max_mm.array()).all());
    }
  }
  EXPECT_LT((landmark(joint, "ankle centre") - some_pose().point(landmark(*bone, "ankle centre"))).norm(), 1e-9);
  EXPECT_EQ(joint.names(), (std::vector<std::string>{"tibia", "fibula"}));
}

// A femur, and another bone far below it, turned.
TEST(Joint, IsTheNearerOfItsBonesAndNumbersThemThroughAllMembers) {
  Pose below = some_pose();
  below.position_mm.z() = -150.0;
  const Joint joint = joint_of(member("upper", "femur"), member("lower", "tibia", below));
  EXPECT_EQ(joint.names(), (std::vector<std::string>{"femur", "tibia", "fibula"}));
  const auto femur = bone_of({}), tibia = bone_of({.kind = "tibia"});
  test::Random random(6);
  std::set<int> numbers;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 at = point_in(joint.bounds(), random);
    const double upper = femur->depths(at).surface_mm;
    const BoneDepths lower = tibia->depths(below.inverse().point(at)), found = joint.depths(at);
    if (std::min(upper, lower.surface_mm) < 3.0) {
      EXPECT_NEAR(found.surface_mm, std::min(upper, lower.surface_mm), 1e-9);
      EXPECT_EQ(found.bone, upper < lower.surface_mm ? 1 : 1 + lower.bone);
      numbers.insert(found.bone);
    }
  }
  EXPECT_EQ(numbers, (std::set<int>{1, 2, 3}));
}

TEST(Joint, EachBoneHasItsOwnDensities) {
  std::vector<JointMember> members;
  members.push_back({"a", bone_of({.changes = {{"cortical_g_cm3", 1.7}, {"marrow_g_cm3", 0.05}}})});
  members.push_back({"b", bone_of({.kind = "tibia", .changes = {{"cortical_g_cm3", 2.0}}}), some_pose()});
  const Joint joint(std::move(members), {});
  EXPECT_EQ(joint.cortical_g_cm3(1), 1.7);
  EXPECT_EQ(joint.marrow_g_cm3(1), 0.05);
  for (const int bone : {2, 3}) {
    EXPECT_EQ(joint.cortical_g_cm3(bone), 2.0);
    EXPECT_EQ(joint.marrow_g_cm3(bone), 0.08);
  }
}

TEST(Joint, ASawnBoneEndsAtThePlaneAndLiesOpen) {
  const Cut cut{{0.0, 0.0, 150.0}, Vec3::UnitZ()};
  const auto bone = bone_of({});
  const Joint joint = joint_of(member("femur", "femur", {}, cut));
  test::Random random(7);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 at = point_in(bone->bounds(), random);
    if (at.z() >= 150.0) {
      EXPECT_EQ(joint.tissue(at), BoneTissue::none);
      EXPECT_GE(joint.depths(at).surface_mm, at.z() - 150.0);
    } else {
      EXPECT_EQ(joint.tissue(at), bone->tissue(at));
    }
    if (joint.depths(at).surface_mm < 0.0) {
      const Box box = joint.bounds();
      EXPECT_TRUE((at.array() >= box.min_mm.array()).all() && (at.array() <= box.max_mm.array()).all());
    }
  }
  // The canal at the cut, of which the shaft's middle is known.
  for (const PlannedAxis& axis : bone->anatomy().axes) {
    if (axis.name != "anatomical axis") continue;
    const Vec3 middle = axis.point_mm + (149.0 - axis.point_mm.z()) / axis.direction.z() * axis.direction;
    EXPECT_EQ(joint.tissue(middle), BoneTissue::marrow);
    EXPECT_NEAR(joint.depths(middle).surface_mm, -1.0, 1e-9);
  }
  EXPECT_NEAR(joint.bounds().max_mm.z(), 150.0, 1e-9);
  EXPECT_EQ(joint.sawn_ends(), (std::array{false, true}));
  EXPECT_LT(joint.bounds().size_mm().x(), 0.8 * bone->bounds().size_mm().x());
}

TEST(Joint, LeavesOutWhatIsSawnOffAndTellsEqualNamesApart) {
  Pose below;
  below.position_mm = {0.0, 0.0, -30.0};
  const Joint joint = joint_of(member("femur", "femur", {}, Cut{{0.0, 0.0, 110.0}, Vec3::UnitZ()}),
                               member("tibia", "tibia", below, Cut{{0.0, 0.0, -110.0}, -Vec3::UnitZ()}));
  std::set<std::string> names, axes;
  for (const Landmark& found : joint.anatomy().landmarks) EXPECT_TRUE(names.insert(found.name).second) << found.name;
  for (const PlannedAxis& found : joint.anatomy().axes) {
    EXPECT_TRUE(axes.insert(found.name).second) << found.name;
    EXPECT_LE(found.point_mm.z(), 110.0 + 1e-9) << found.name;
    EXPECT_GE(found.point_mm.z(), -140.0 - 1e-9) << found.name;
  }
  for (const char* there : {"femur, knee centre", "tibia, knee centre", "medial epicondyle", "tibial tuberosity"})
    EXPECT_TRUE(names.contains(there)) << there;
  for (const char* gone : {"head centre", "greater trochanter", "ankle centre", "medial malleolus"})
    EXPECT_FALSE(names.contains(gone)) << gone;
  for (const char* there : {"femur, mechanical axis", "tibia, mechanical axis", "anatomical axis", "plateau slope"})
    EXPECT_TRUE(axes.contains(there)) << there;
  EXPECT_FALSE(axes.contains("neck axis"));
  // A line stays the same line.
  const auto femur = bone_of({});
  for (const PlannedAxis& whole : femur->anatomy().axes)
    for (const PlannedAxis& sawn : joint.anatomy().axes)
      if (sawn.name == whole.name) {
        EXPECT_LT((sawn.point_mm - whole.point_mm).cross(whole.direction).norm(), 1e-9) << sawn.name;
      }
}

TEST(Joint, ParametersHaveTheNameOfTheirBone) {
  const Joint joint = joint_of(member("femur", "femur"), member("tibia", "tibia", some_pose()));
  std::map<std::string, double> found;
  for (const NamedValue& value : joint.parameters()) EXPECT_TRUE(found.emplace(value.name, value.value).second);
  EXPECT_EQ(found.at("femur.length_mm"), FemurParameters{}.length_mm);
  EXPECT_EQ(found.at("tibia.length_mm"), TibiaParameters{}.length_mm);
}

TEST(Joint, ChangesGoToTheirMembers) {
  constexpr std::string_view kOwn[] = {"gap_mm", "cut_mm"};
  const MemberParameters members[] = {{"femur", {"length_mm", "offset_mm"}}, {"tibia", {"length_mm", "slope_degrees"}}};
  const auto found = joint_changes("knee", {{"gap_mm", 5.0}, {"femur.length_mm", 400.0}}, kOwn, members);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->own, (std::map<std::string, double>{{"gap_mm", 5.0}}));
  EXPECT_EQ(found->members.at("femur"), (std::map<std::string, double>{{"length_mm", 400.0}}));
  EXPECT_TRUE(found->members.at("tibia").empty());
  // The example is a bone's parameter of that name, if there is one.
  for (const auto& [name, example] : {std::pair{"wing.length_mm", "femur.length_mm"},
                                      {"slope_degrees", "tibia.slope_degrees"},
                                      {"wing_mm", "femur.length_mm"}}) {
    const auto wrong = joint_changes("knee", {{name, 1.0}}, kOwn, members);
    ASSERT_FALSE(wrong) << name;
    EXPECT_EQ(wrong.error().message, std::string("\"") + name +
                                         "\" is no parameter of a knee; write gap_mm, cut_mm, or a bone's parameter "
                                         "after its name, such as " +
                                         example);
  }
}

TEST(Joint, BonesOfOneNameAreToldApart) {
  const Joint joint = joint_of(member("left", "femur"), member("right", "femur"), member("lower", "tibia"));
  EXPECT_EQ(joint.names(), (std::vector<std::string>{"left, femur", "right, femur", "tibia", "fibula"}));
}

TEST(Joint, AMembersErrorBeginsWithItsName) {
  EXPECT_EQ(of_member("femur", Result<int>(bad_input("shell_mm is 9; give a value from 0.6 to 4"))).error().message,
            "femur.shell_mm is 9; give a value from 0.6 to 4");
  EXPECT_EQ(of_member("femur", Result<int>(bad_input("\"wing_mm\" is no parameter of this bone"))).error().message,
            "\"femur.wing_mm\" is no parameter of this bone");
}

TEST(Joint, PointsAndLinesThatABoneDoesNotHaveAreABrokenPromise) {
  const auto bone = bone_of({});
  EXPECT_EQ(point_of(*bone, "head centre"), landmark(*bone, "head centre"));
  EXPECT_GT(line_of(*bone, "sciatic nerve").size(), 2u);
  EXPECT_DEATH(static_cast<void>(point_of(*bone, "wing")), "landmarks");
  EXPECT_DEATH(static_cast<void>(line_of(*bone, "wing")), "structures");
}

// Two femurs side by side: their boxes overlap, and their epicondyles face each other across a known gap.
TEST(Joint, FindsMembersThatComeNearerThanAGap) {
  const FemurParameters p;
  for (const double gap : {-1.0, 0.5, 3.0}) {
    Pose beside;
    beside.position_mm = {p.bicondylar_width_mm + gap, 0.0, 0.0};
    // Sawn below the trochanters, which are wider.
    const Cut cut{{0.0, 0.0, 60.0}, Vec3::UnitZ()};
    const Joint joint = joint_of(member("a", "femur", {}, cut), member("b", "femur", beside, cut));
    EXPECT_FALSE(joint.nearer_than(gap - 0.2)) << gap;
    const auto found = joint.nearer_than(gap + 0.2);
    ASSERT_TRUE(found) << gap;
    EXPECT_EQ(*found, (std::pair<std::string, std::string>("a", "b")));
  }
}

}  // namespace
}  // namespace osteon::phantoms
