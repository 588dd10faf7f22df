// The closed forms of a femur: its anatomy, its sides, its tissues, and parameters that no femur has.
#include "common/phantoms/femur.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "tests/support/scenes/random.hpp"
#include "tests/unit/phantoms/islands.hpp"
#include "tests/unit/phantoms/made_bones.hpp"

namespace osteon::phantoms {
namespace {

BoneRecipe recipe_of(Side side = Side::left) {
  BoneRecipe recipe;
  recipe.side = side;
  return recipe;
}

PlannedAxis axis(const PhantomBone& bone, const std::string& name) {
  for (const PlannedAxis& found : bone.anatomy().axes)
    if (found.name == name) return found;
  ADD_FAILURE() << "no axis " << name;
  return {};
}

double angle_degrees(const Vec3& a, const Vec3& b) {
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

TEST(Femur, LandmarksLieOnTheSurface) {
  const auto bone = bone_of(recipe_of());
  for (const char* name :
       {"medial epicondyle", "lateral epicondyle", "medial posterior condyle", "lateral posterior condyle",
        "medial distal condyle", "lateral distal condyle", "greater trochanter", "lesser trochanter"})
    EXPECT_NEAR(bone->depths(landmark(*bone, name)).surface_mm, 0.0, 0.05) << name;
  EXPECT_NEAR(bone->depths(landmark(*bone, "head centre")).surface_mm, -0.5 * FemurParameters{}.head_diameter_mm, 0.5);
}

TEST(Femur, AnglesAndLengthsBetweenLandmarksAreItsParameters) {
  for (const Side side : {Side::left, Side::right}) {
    const auto bone = bone_of(recipe_of(side));
    const FemurParameters p;
    const Vec3 shaft = axis(*bone, "anatomical axis").direction, neck = axis(*bone, "neck axis").direction;
    EXPECT_NEAR(angle_degrees(neck, -shaft), p.neck_shaft_degrees, 1e-9);
    // Anteversion: between neck and posterior condyles, seen along the shaft.
    const Vec3 condyles = landmark(*bone, "medial posterior condyle") - landmark(*bone, "lateral posterior condyle");
    const auto across = [&](const Vec3& v) { return Vec3(v - v.dot(shaft) * shaft); };
    EXPECT_NEAR(angle_degrees(across(neck), across(condyles)), p.anteversion_degrees, 1e-9);
    EXPECT_LT(neck.y(), 0.0);  // the neck points forwards
    EXPECT_NEAR(angle_degrees(shaft, Vec3::UnitZ()), p.shaft_valgus_degrees, 1e-9);
    const Vec3 head = landmark(*bone, "head centre");
    EXPECT_NEAR(head.z() + 0.5 * p.head_diameter_mm - landmark(*bone, "medial distal condyle").z(), p.length_mm, 1e-9);
    EXPECT_NEAR(landmark(*bone, "lateral distal condyle").z(), landmark(*bone, "medial distal condyle").z(), 1e-9);
    EXPECT_NEAR(std::abs(landmark(*bone, "medial epicondyle").x() - landmark(*bone, "lateral epicondyle").x()),
                p.bicondylar_width_mm, 1e-9);
    EXPECT_NEAR(landmark(*bone, "greater trochanter").z() - landmark(*bone, "lesser trochanter").z(), p.trochanters_mm,
                1e-6);
    // The lateral side of a left femur is at +x.
    EXPECT_EQ(landmark(*bone, "lateral epicondyle").x() > 0.0, side == Side::left);
  }
}

TEST(Femur, RightIsTheMirrorImageOfLeft) {
  const auto left = bone_of(recipe_of(Side::left)), right = bone_of(recipe_of(Side::right));
  test::Random random(17);
  const Box box = left->bounds();
  for (int i = 0; i < 4000; ++i) {
    const Vec3 at(random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
                  random.between(box.min_mm.z(), box.max_mm.z()));
    const Vec3 mirrored(-at.x(), at.y(), at.z());
    EXPECT_EQ(left->depths(at).surface_mm, right->depths(mirrored).surface_mm);
    EXPECT_EQ(left->tissue(at), right->tissue(mirrored));
    EXPECT_EQ(left->density_g_cm3(at, 0.5), right->density_g_cm3(mirrored, 0.5));
  }
}

TEST(Femur, DistancesAreThoseToTheSurfaceToFirstOrder) {
  const auto bone = bone_of(recipe_of());
  test::Random random(23);
  const Box box = bone->bounds();
  int near = 0, alike = 0;
  for (int i = 0; i < 60000; ++i) {
    const Vec3 at(random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
                  random.between(box.min_mm.z(), box.max_mm.z()));
    const double s = bone->depths(at).surface_mm;
    if (std::abs(s) > 1.5) continue;
    ++near;
    constexpr double kStep = 1e-4;
    Vec3 gradient;
    for (int axis_number = 0; axis_number < 3; ++axis_number) {
      Vec3 off = Vec3::Zero();
      off[axis_number] = kStep;
      gradient[axis_number] = (bone->depths(at + off).surface_mm - bone->depths(at - off).surface_mm) / (2.0 * kStep);
    }
    // Less where parts blend in a groove, because their directions differ.
    EXPECT_GT(gradient.norm(), 0.3) << at.transpose();
    EXPECT_LT(gradient.norm(), 1.3) << at.transpose();
    alike += std::abs(gradient.norm() - 1.0) < 0.1 ? 1 : 0;
  }
  EXPECT_GT(near, 1000);
  EXPECT_GT(alike, 0.85 * near);
}

TEST(Femur, TissuesLieInsideOneAnother) {
  const auto bone = bone_of(recipe_of());
  const FemurParameters p;
  const PlannedAxis shaft = axis(*bone, "anatomical axis");
  EXPECT_EQ(bone->tissue(shaft.point_mm), BoneTissue::marrow);
  EXPECT_EQ(bone->density_g_cm3(shaft.point_mm, 0.5), p.marrow_g_cm3);
  const Vec3 knee = landmark(*bone, "medial distal condyle");
  EXPECT_EQ(bone->tissue(knee + Vec3(0, 0, 0.5 * p.shell_mm)), BoneTissue::cortical);
  EXPECT_EQ(bone->tissue(knee + Vec3(0, 0, 4.0)), BoneTissue::cancellous);
  EXPECT_EQ(bone->tissue(knee - Vec3(0, 0, 0.5)), BoneTissue::none);
  // A sample at a face is half of each tissue.
  EXPECT_NEAR(bone->density_g_cm3(knee + Vec3(0, 0, p.shell_mm), 0.5),
              0.5 * (p.cortical_g_cm3 + bone->cancellous_g_cm3(knee + Vec3(0, 0, p.shell_mm))), 1e-9);
}

TEST(Femur, ConditionsOrderCortexAndDensity) {
  double cortex = 0.0, cancellous = 0.0;
  for (const char* condition : {"osteoporotic", "adult", "young"}) {
    BoneRecipe recipe = recipe_of();
    recipe.condition = condition;
    const auto p = femur_parameters(recipe);
    ASSERT_TRUE(p) << p.error().message;
    EXPECT_GT(p->cortex_55_mm, cortex);
    EXPECT_GT(p->cancellous_g_cm3, cancellous);
    cortex = p->cortex_55_mm;
    cancellous = p->cancellous_g_cm3;
  }
}

TEST(Femur, EveryPresetIsAFemurInEveryCondition) {
  std::set<double> lengths;
  for (const std::string_view preset : kPresets)
    for (const std::string_view condition : kConditions) {
      BoneRecipe recipe = recipe_of();
      recipe.preset = preset;
      recipe.condition = condition;
      const auto p = femur_parameters(recipe);
      ASSERT_TRUE(p) << preset << ", " << condition << ": " << p.error().message;
      lengths.insert(p->length_mm);
    }
  EXPECT_EQ(lengths.size(), std::size(kPresets));
}

TEST(Femur, ImpossibleParametersAreOneSentenceThatNamesThemAndTheirRange) {
  const auto refused = [](const std::string& name, double value, const std::string& also) {
    expect_refused("femur", name, value, also);
  };
  expect_ranges("femur", femur_fields());
  // Within its range, but not beside the others.
  refused("neck_height_mm", 46.0, "head_diameter_mm");
  refused("neck_depth_mm", 40.0, "neck_height_mm");
  refused("proximal_width_mm", 66.0, "offset_mm");
  refused("cortex_55_mm", 11.0, "the shaft's width");
  refused("condyle_width_mm", 35.0, "radii");
  refused("bicondylar_width_mm", 60.0, "notch_width_mm");
  refused("shaft_forward_mm", 44.0, "condyle_depth_mm");
  refused("no_such_mm", 1.0, "length_mm");
}

TEST(Femur, WordsThatAreNotKnownAreRefused) {
  for (int which = 0; which < 3; ++which) {
    BoneRecipe recipe;
    (which == 0 ? recipe.kind : which == 1 ? recipe.preset : recipe.condition) = "wing";
    const auto made = make_bone(recipe);
    ASSERT_FALSE(made);
    EXPECT_NE(made.error().message.find("\"wing\" is not known; give one of"), std::string::npos)
        << made.error().message;
  }
}

TEST(Femur, TwoHundredRandomFemursAreOneClosedPieceEach) {
  test::Random random(41);
  int refused = 0;
  for (int made = 0; made < 200;) {
    BoneRecipe recipe = recipe_of(made % 2 == 0 ? Side::left : Side::right);
    recipe.preset = kPresets[random.index(std::size(kPresets))];
    recipe.condition = kConditions[random.index(std::size(kConditions))];
    const auto p = femur_parameters(recipe);
    ASSERT_TRUE(p) << p.error().message;
    for (const auto& field : femur_fields()) {
      const double value = *p.*field.value, spread = 0.08 * std::max(std::abs(value), 0.2 * field.most);
      recipe.changes[std::string(field.name)] =
          std::clamp(value + random.between(-spread, spread), field.least, field.most);
    }
    const auto bone = make_bone(recipe);
    if (!bone) {
      ASSERT_LT(++refused, 2000) << bone.error().message;
      continue;
    }
    ++made;
    ASSERT_EQ(islands_of(**bone, 3.5), std::vector<int>{1}) << "set " << made;
    // Head, trochanters and condyles are there, and the canal is open.
    for (const Landmark& found : (*bone)->anatomy().landmarks)
      if (found.name != "knee centre") {  // in the notch
        EXPECT_LT((*bone)->depths(found.point_mm).surface_mm, 0.6) << found.name << ", set " << made;
      }
    EXPECT_EQ((*bone)->tissue(axis(**bone, "anatomical axis").point_mm), BoneTissue::marrow) << "set " << made;
  }
}

// The most bowed shaft stands out before the condyles and the head.
TEST(Femur, BoundsContainTheBone) {
  for (const double bow_radius_mm : {500.0, 943.0}) {
    const auto bone =
        bone_of({.kind = "femur", .changes = {{"bow_radius_mm", bow_radius_mm}, {"shaft_forward_mm", 31.0}}});
    ASSERT_TRUE(bone);
    const Box bounds = bone->bounds(), around = bounds.grown(20.0);
    for (double x = around.min_mm.x(); x < around.max_mm.x(); x += 3.0)
      for (double y = around.min_mm.y(); y < around.max_mm.y(); y += 3.0)
        for (double z = around.min_mm.z(); z < around.max_mm.z(); z += 6.0) {
          const Vec3 at(x, y, z);
          if (bone->depths(at).surface_mm >= 0.0) continue;
          ASSERT_TRUE((at.array() >= bounds.min_mm.array()).all() && (at.array() <= bounds.max_mm.array()).all())
              << at.transpose();
        }
  }
}

}  // namespace
}  // namespace osteon::phantoms
