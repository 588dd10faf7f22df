// A hip: the head in the acetabulum, the gap between them, the cut of the shaft, and recipes that do not fit.
#include "common/phantoms/hip.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/phantoms/femur.hpp"
#include "common/phantoms/pelvis.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/phantoms/islands.hpp"
#include "tests/unit/phantoms/made_bones.hpp"

namespace osteon::phantoms {
namespace {

TEST(Hip, HeadAndAcetabulumHaveOneCentreAndTheGapBetweenThem) {
  const auto hip = bone_of({.kind = "hip"});
  ASSERT_EQ(hip->names(), (std::vector<std::string>{"hip bone", "femur"}));
  const Vec3 centre = landmark(*hip, "acetabular centre");
  EXPECT_NEAR((landmark(*hip, "head centre") - centre).norm(), 0.0, 1e-9);
  EXPECT_GT(centre.x(), 0.0);  // the left one, in LPS
  // Along rays to the lunate surface: the femur's head, the gap, the roof.
  const double head = 0.5 * FemurParameters{}.head_diameter_mm,
               socket = 0.5 * PelvisParameters{}.acetabulum_diameter_mm;
  for (const Vec3& way : {Vec3(0.0, 0.0, 1.0), Vec3(0.0, 0.6, 0.8), Vec3(0.2, 0.2, 0.9), Vec3(0.1, -0.4, 0.9)}) {
    const auto at = [&](double radius_mm) { return hip->depths(centre + radius_mm * way.normalized()); };
    EXPECT_NEAR(at(head).surface_mm, 0.0, 0.02) << way.transpose();
    EXPECT_NEAR(at(socket).surface_mm, 0.0, 0.02) << way.transpose();
    EXPECT_EQ(at(head - 1.0).bone, 2);
    EXPECT_EQ(at(socket + 1.0).bone, 1);
    EXPECT_GT(at(0.5 * (head + socket)).surface_mm, 0.49 * (socket - head));
  }
}

TEST(Hip, CartilageOfBothFillsTheGap) {
  const auto hip = bone_of({.kind = "hip"});
  const Vec3 centre = landmark(*hip, "acetabular centre"), way = Vec3(-0.4, -0.2, 0.8).normalized();
  const double head = 0.5 * FemurParameters{}.head_diameter_mm,
               socket = 0.5 * PelvisParameters{}.acetabulum_diameter_mm;
  const std::vector<Structure> structures = hip->structures();
  for (int part = 1; part < 20; ++part) {
    const double radius = head + 0.05 * part * (socket - head);
    if (std::abs(radius - 0.5 * (head + socket)) < 0.05) continue;  // where they meet
    std::string found;
    for (const Structure& structure : structures)
      if (structure.distance_mm(centre + radius * way) < 0.0) found += structure.name;
    EXPECT_EQ(found, radius < 0.5 * (head + socket) ? "femoral head cartilage" : "acetabular cartilage") << radius;
  }
}

TEST(Hip, RightIsTheMirrorImageOfLeft) {
  const auto left = bone_of({.kind = "hip", .side = Side::left}), right = bone_of({.kind = "hip", .side = Side::right});
  test::Random random(71);
  const Box box = left->bounds();
  for (int i = 0; i < 4000; ++i) {
    const Vec3 at(random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
                  random.between(box.min_mm.z(), box.max_mm.z()));
    const BoneDepths here = left->depths(at), there = right->depths(Vec3(-at.x(), at.y(), at.z()));
    EXPECT_NEAR(here.surface_mm, there.surface_mm, 1e-9);
    if (std::abs(here.surface_mm) > 1e-6) {
      EXPECT_EQ(here.bone, there.bone);
    }
  }
}

TEST(Hip, EveryPresetIsTwoBonesThatEndAtTheCut) {
  for (const std::string_view preset : kPresets) {
    const auto hip = bone_of({.kind = "hip", .preset = std::string(preset), .changes = {{"shaft_mm", 45.0}}});
    ASSERT_TRUE(hip) << preset;
    const double end = landmark(*hip, "lesser trochanter").z() - 45.0;
    constexpr double kCoarse_mm = 3.0;
    const Box bounds = hip->bounds();
    const CoordBox box = covering_samples(bounds.grown(2.0 * kCoarse_mm), kCoarse_mm);
    std::vector<float> solid[2];
    double lowest = 0.0;
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z) {
          const Vec3 at = position_mm({x, y, z}, kCoarse_mm);
          const BoneDepths depths = hip->depths(at);
          for (int bone = 1; bone <= 2; ++bone)
            solid[bone - 1].push_back(depths.surface_mm < 0.0 && depths.bone == bone ? -1.0f : 1.0f);
          if (depths.surface_mm >= 0.0) continue;
          ASSERT_TRUE((at.array() >= bounds.min_mm.array()).all() && (at.array() <= bounds.max_mm.array()).all())
              << at.transpose() << ", " << preset;
          if (depths.bone == 2) lowest = std::min(lowest, at.z());
        }
    for (const std::vector<float>& bone : solid) EXPECT_EQ(count_islands(box.dims(), bone), 1) << preset;
    EXPECT_NEAR(lowest, end, kCoarse_mm) << preset;
    EXPECT_GE(lowest, end) << preset;
  }
}

TEST(Hip, RandomHipsAreTwoClosedPiecesEach) {
  test::Random random(73);
  for (int set = 0; set < random_sets(); ++set) {
    const auto hip = random_bone("hip", 0.05, random);
    ASSERT_TRUE(hip);
    EXPECT_EQ(islands_of(*hip, 3.0), (std::vector<int>{1, 1})) << "set " << set;
  }
}

TEST(Hip, RecipesThatDoNotFitAreOneSentence) {
  const auto refused = [](const std::string& name, double value, const std::string& also) {
    expect_refused("hip", name, value, also);
  };
  refused("shaft_mm", 500.0, "give a value from 20 to 150");
  refused("femur.head_diameter_mm", 51.5, "pelvis.acetabulum_diameter_mm; give a value from 44 to 50");
  refused("femur.neck_shaft_degrees", 170.0, "femur.neck_shaft_degrees is 170; give a value");
  refused("pelvis.inclination_degrees", 80.0, "pelvis.inclination_degrees is 80; give a value");
  refused("pelvis.cartilage_mm", 3.5, "at most the gap between head and acetabulum");
  refused("patella.width_mm", 40.0, "is no parameter of a hip; write shaft_mm, or a bone's parameter after its name");
  refused("neck_shaft_degrees", 120.0,
          "is no parameter of a hip; write shaft_mm, or a bone's parameter after its name, "
          "such as femur.neck_shaft_degrees");
}

// Each parameter of the hip at the ends of its range: made, or refused by a sentence that names it.
TEST(Hip, EndsOfRangesAreMadeOrNamed) {
  for (const std::string_view preset : kPresets)
    for (const auto& field : hip_fields())
      for (const double value : {field.least, field.most}) {
        const std::string name(field.name);
        const auto made = make_bone({.kind = "hip", .preset = std::string(preset), .changes = {{name, value}}});
        EXPECT_TRUE(made || made.error().message.starts_with(name + " is ")) << preset << ": " << made.error().message;
      }
}

}  // namespace
}  // namespace osteon::phantoms
