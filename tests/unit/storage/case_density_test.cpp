// The density that viewers get, compared with that of the bone.
#include "server/storage/case_density.hpp"

#include <gtest/gtest.h>

#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

TEST(CaseDensity, IsThatOfTheBone) {
  const Case bone = test::make_bone(
      {Vec3::Constant(-13), Vec3::Constant(13)}, 0.5, [](const Vec3& p) { return p.norm() - 10.0; },
      [](const Vec3& p) { return 1.0 + 0.03 * p.x() - 0.02 * p.y() + 0.01 * p.z(); });
  const DensityGrid density = density_of(bone);
  EXPECT_EQ(density.pitch_mm(), 0.5);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p = 9.0 * Vec3(std::sin(1.0 * i), std::sin(2.3 * i + 1.0), std::sin(3.1 * i + 2.0)) / std::sqrt(3.0);
    // Linear between samples, and each sample rounded to a step.
    EXPECT_NEAR(density.g_cm3(p), 1.0 + 0.03 * p.x() - 0.02 * p.y() + 0.01 * p.z(), 0.5 * kDensityStep_g_cm3 + 1e-6);
  }
  EXPECT_EQ(density.g_cm3(Vec3(40, 0, 0)), 0.0);
}

TEST(CaseDensity, OfALargeBoneIsCoarser) {
  const Case bone = test::large_ball(90.0, 0.5);
  const DensityGrid density = density_of(bone);
  EXPECT_EQ(density.pitch_mm(), 1.0);
  EXPECT_LE(density.leaves().size(), kMostDensityLeaves);
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(50, 30, -40), Vec3(-88, 0, 0)}) EXPECT_NEAR(density.g_cm3(p), 1.9, 0.006);
}

}  // namespace
}  // namespace osteon
