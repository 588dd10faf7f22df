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
// lattice may be left out that the surface cannot reach.
TEST(PhantomBone, NoSurfaceIsNearerThanADistanceSays) {
  constexpr double kAround_mm = 10.0, kBeside_mm = 12.0;
  constexpr int kPoints = 20000, kWays = 12;
  test::Random random(17);
  for (const std::string_view kind : kBoneKinds)
    for (const std::string_view preset : kPresets) {
      const auto bone = bone_of({.kind = std::string(kind), .preset = std::string(preset)});
      const Box box = bone->bounds().grown(kAround_mm);
      double steepest = 0.0;
      Vec3 where = Vec3::Zero();
      for (int i = 0; i < kPoints; ++i) {
        const Vec3 at(random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
                      random.between(box.min_mm.z(), box.max_mm.z()));
        const double here = bone->depths(at).surface_mm;
        if (i % 4 != 0 && std::abs(here) > kBeside_mm) continue;
        for (int way = 0; way < kWays; ++way) {
          const double apart = random.between(0.0, 1.2) * std::abs(here);
          if ((bone->depths(at + apart * random.direction()).surface_mm < 0.0) == (here < 0.0)) continue;
          if (std::abs(here) / apart <= steepest) continue;
          steepest = std::abs(here) / apart;
          where = at;
        }
      }
      EXPECT_LE(steepest, kSteepest) << kind << ", " << preset << ", at " << where.transpose();
      std::printf("[          ] %s, %s: %.3f\n", std::string(kind).c_str(), std::string(preset).c_str(), steepest);
    }
}

}  // namespace
}  // namespace osteon::phantoms
