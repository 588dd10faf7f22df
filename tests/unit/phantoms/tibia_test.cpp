#include "common/phantoms/tibia.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/scenes/random.hpp"
#include "tests/unit/phantoms/islands.hpp"
#include "tests/unit/phantoms/made_bones.hpp"

namespace osteon::phantoms {
namespace {

std::unique_ptr<PhantomBone> tibia_of(Side side) { return bone_of({.kind = "tibia", .side = side}); }

TEST(Tibia, LandmarksLieOnTheSurface) {
  const auto bone = tibia_of(Side::left);
  for (const char* name : {"tibial tuberosity", "medial malleolus", "lateral malleolus", "fibular head"})
    EXPECT_NEAR(bone->depths(landmark(*bone, name)).surface_mm, 0.0, 0.05) << name;
}

TEST(Tibia, HasItsLengthAndSlope) {
  const auto bone = tibia_of(Side::left);
  const TibiaParameters p;
  EXPECT_NEAR(-landmark(*bone, "medial malleolus").z(), p.length_mm, 1e-9);
  EXPECT_NEAR(landmark(*bone, "fibular head").z() - landmark(*bone, "lateral malleolus").z(), p.fibula_length_mm, 1e-9);
  // The plateau falls backwards: its height where a line from above meets the bone.
  const auto height = [&](double y) {
    double z = 40.0;
    while (bone->depths({0.3 * p.plateau_width_mm, y, z}).surface_mm > 0.0) z -= 0.01;
    return z;
  };
  const double fall = (height(-8.0) - height(8.0)) / 16.0;  // y is backwards
  EXPECT_NEAR(std::atan(fall) * 180.0 / std::numbers::pi, p.slope_degrees, 0.5);
}

TEST(Tibia, RightIsTheMirrorImageOfLeft) {
  const auto left = tibia_of(Side::left), right = tibia_of(Side::right);
  test::Random random(29);
  const Box box = left->bounds();
  for (int i = 0; i < 4000; ++i) {
    const Vec3 at(random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
                  random.between(box.min_mm.z(), box.max_mm.z()));
    const Vec3 mirrored(-at.x(), at.y(), at.z());
    EXPECT_EQ(left->depths(at).surface_mm, right->depths(mirrored).surface_mm);
    EXPECT_EQ(left->depths(at).bone, right->depths(mirrored).bone);
  }
  EXPECT_GT(landmark(*left, "fibular head").x(), 0.0);
}

TEST(Tibia, EveryPresetIsATibiaWhoseBonesDoNotTouch) {
  for (const std::string_view preset : kPresets)
    for (const std::string_view condition : kConditions) {
      const auto bone = make_bone(
          {.kind = "tibia", .side = Side::left, .preset = std::string(preset), .condition = std::string(condition)});
      ASSERT_TRUE(bone) << preset << ": " << bone.error().message;
      // Beside every sample of the fibula there is no sample of the tibia.
      const Box box = (*bone)->bounds();
      constexpr double kCoarse_mm = 2.0;
      for (double x = box.min_mm.x(); x < box.max_mm.x(); x += kCoarse_mm)
        for (double y = box.min_mm.y(); y < box.max_mm.y(); y += kCoarse_mm)
          for (double z = box.min_mm.z(); z < box.max_mm.z(); z += kCoarse_mm) {
            const BoneDepths at = (*bone)->depths({x, y, z});
            if (at.surface_mm > 0.0 || at.bone == 1) continue;
            const double beside_mm = 1.0;
            for (int axis = 0; axis < 3; ++axis)
              for (const double way : {-beside_mm, beside_mm}) {
                Vec3 p(x, y, z);
                p[axis] += way;
                const BoneDepths next = (*bone)->depths(p);
                ASSERT_FALSE(next.surface_mm < 0.0 && next.bone == 1) << preset << " " << p.transpose();
              }
          }
    }
}

TEST(Tibia, RandomTibiaeAreTwoClosedPiecesEach) {
  test::Random random(43);
  for (int set = 0; set < random_sets(); ++set) {
    const auto bone = random_bone("tibia", 0.08, random);
    ASSERT_TRUE(bone);
    ASSERT_EQ(islands_of(*bone, 3.0), (std::vector<int>{1, 1})) << "set " << set;
    for (const Landmark& found : bone->anatomy().landmarks)
      if (found.name.find("centre") == std::string::npos) {
        EXPECT_NEAR(bone->depths(found.point_mm).surface_mm, 0.0, 0.3) << found.name << ", set " << set;
      }
  }
}

TEST(Tibia, ImpossibleParametersAreOneSentence) {
  const auto refused = [](const std::string& name, double value, const std::string& also) {
    expect_refused("tibia", name, value, also);
  };
  expect_ranges("tibia", tibia_fields());
  refused("width_86_mm", 66.0, "plateau_width_mm");
  refused("fibula_length_mm", 300.0, "length_mm");
  refused("head_diameter_mm", 44.0, "no parameter");
}

}  // namespace
}  // namespace osteon::phantoms
