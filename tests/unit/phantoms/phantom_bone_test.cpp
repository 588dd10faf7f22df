// What holds for the distance of every kind of phantom bone.
#include "common/phantoms/phantom_bone.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/scenes/random.hpp"
#include "tests/unit/phantoms/made_bones.hpp"

namespace osteon::phantoms {
namespace {

// Beside the surface, the distance grows no faster than kSteepest. Farther away, where it may jump, the surface is
// still at least as far as the distance says, divided by kSteepest. So a case may leave out what the surface cannot
// reach.
void expect_steepest(const PhantomBone& bone, const Box& box, const std::string& which, test::Random& random) {
  constexpr double kNear_mm = 2.0, kFar_mm = 12.0, kApart_mm = 1e-3;
  constexpr int kPoints = 20000, kSteps = 100;
  const auto distance = [&](const Vec3& at) { return bone.depths(at).surface_mm; };
  double near = 0.0, far = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const Vec3 at(random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
                  random.between(box.min_mm.z(), box.max_mm.z()));
    const double here = distance(at);
    if (std::abs(here) > kFar_mm) continue;
    Vec3 rise;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 step = kApart_mm * Vec3::Unit(axis);
      rise[axis] = (distance(at + step) - distance(at - step)) / (2.0 * kApart_mm);
    }
    if (std::abs(here) < kNear_mm) {
      near = std::max(near, rise.norm());
      continue;
    }
    const Vec3 to_surface = (here > 0.0 ? -rise : rise).normalized();
    for (int step = 1; step < kSteps; ++step) {
      const double part = static_cast<double>(step) / kSteps;
      if ((distance(at + part * std::abs(here) * to_surface) < 0.0) == (here < 0.0)) continue;
      far = std::max(far, 1.0 / part);
      break;
    }
  }
  EXPECT_LE(near, kSteepest) << which;
  EXPECT_LE(far, kSteepest) << which;
  std::printf("[          ] %s: %.2f beside the surface, %.2f farther away\n", which.c_str(), near, far);
}

TEST(PhantomBone, ADistanceIsNoSteeperThanSteepest) {
  test::Random random(17);
  const auto expect = [&](const PhantomBone& bone, const std::string& which) {
    expect_steepest(bone, bone.bounds().grown(10.0), which, random);
  };
  for (const std::string_view kind : kBoneKinds)
    for (const std::string_view preset : kPresets)
      expect(*bone_of({.kind = std::string(kind), .preset = std::string(preset)}),
             std::string(kind) + ", " + std::string(preset));
  for (int set = 0; set < 6; ++set) {
    expect(*random_bone("pelvis", 0.12, random), "pelvis, set " + std::to_string(set));
    expect(*random_bone("hip", 0.05, random), "hip, set " + std::to_string(set));
  }
  // The front of a wing below a spine that is low or far forward, where it is flat.
  for (const auto& [height_mm, forward_mm] : {std::pair{66.0, 44.0}, {76.0, 50.0}, {58.1, 52.0}}) {
    const auto flat =
        bone_of({.kind = "pelvis", .changes = {{"spine_height_mm", height_mm}, {"plane_forward_mm", forward_mm}}});
    const Vec3 spine = landmark(*flat, "left anterior superior iliac spine");
    expect_steepest(*flat, Box{spine - Vec3(35.0, 5.0, 40.0), spine + Vec3(10.0, 45.0, 5.0)}, "flat front", random);
  }
}

}  // namespace
}  // namespace osteon::phantoms
