// What holds for the distance of every kind of phantom bone.
#include "common/phantoms/phantom_bone.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/scenes/random.hpp"
#include "tests/unit/phantoms/made_bones.hpp"

namespace osteon::phantoms {
namespace {

// From any point, the surface is at least as far as the distance there says, divided by kSteepest. So parts of a
// lattice may be left out that the surface cannot reach. It is sought where it is nearest, straight down the distance.
TEST(PhantomBone, NoSurfaceIsNearerThanADistanceSays) {
  constexpr double kAround_mm = 10.0, kBeside_mm = 12.0, kStep_mm = 1e-3;
  constexpr int kPoints = 20000, kSteps = 60;
  test::Random random(17);
  for (const std::string_view kind : kBoneKinds)
    for (const std::string_view preset : kPresets) {
      const auto bone = bone_of({.kind = std::string(kind), .preset = std::string(preset)});
      const auto distance = [&](const Vec3& at) { return bone->depths(at).surface_mm; };
      const Box box = bone->bounds().grown(kAround_mm);
      double steepest = 0.0;
      Vec3 where = Vec3::Zero();
      for (int i = 0; i < kPoints; ++i) {
        const Vec3 at(random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
                      random.between(box.min_mm.z(), box.max_mm.z()));
        const double here = distance(at);
        if (std::abs(here) > kBeside_mm) continue;
        Vec3 rise;
        for (int axis = 0; axis < 3; ++axis)
          rise[axis] = distance(at + kStep_mm * Vec3::Unit(axis)) - distance(at - kStep_mm * Vec3::Unit(axis));
        const Vec3 direction = (here > 0.0 ? -rise : rise).normalized();
        for (int step = 1; step < kSteps; ++step) {
          const double apart = std::abs(here) * step / kSteps;
          if ((distance(at + apart * direction) < 0.0) == (here < 0.0)) continue;
          if (std::abs(here) / apart > steepest) {
            steepest = std::abs(here) / apart;
            where = at;
          }
          break;
        }
      }
      EXPECT_LE(steepest, kSteepest) << kind << ", " << preset << ", at " << where.transpose();
      std::printf("[          ] %s, %s: %.3f\n", std::string(kind).c_str(), std::string(preset).c_str(), steepest);
    }
}

}  // namespace
}  // namespace osteon::phantoms
