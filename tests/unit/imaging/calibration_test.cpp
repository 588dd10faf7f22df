#include "common/imaging/calibration.hpp"

#include <gtest/gtest.h>

namespace osteon::imaging {
namespace {

TEST(Calibration, FollowsRhoHobathoAshman) {
  // ρ = 131 + 1.067 HU kg/m³, at three points computed by hand.
  EXPECT_NEAR(density_g_cm3(kRho1995, 0.0), 0.131, 1e-12);
  EXPECT_NEAR(density_g_cm3(kRho1995, 1000.0), 1.198, 1e-12);
  EXPECT_NEAR(density_g_cm3(kRho1995, 1600.0), 1.8382, 1e-12);
}

TEST(Calibration, IsNeverNegative) { EXPECT_EQ(density_g_cm3(kRho1995, kAir_hu), 0.0); }

TEST(Calibration, InvertsToTheSameDensity) {
  for (const double density : {0.2, 0.3, 1.0, 1.9})
    EXPECT_NEAR(density_g_cm3(kRho1995, hounsfield(kRho1995, density)), density, 1e-12);
}

}  // namespace
}  // namespace osteon::imaging
