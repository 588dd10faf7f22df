#include "common/imaging/cortex_profile.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace osteon::imaging {
namespace {

constexpr double kFirst_mm = -3.0, kStep_mm = 0.2;
constexpr int kValues = 46;  // up to 6 mm

double phi(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

// A rectangle on two plateaus, convolved with a Gaussian: the closed form.
std::vector<double> blurred(double outside, double cortex, double inside, double outer, double thickness,
                            double sigma) {
  std::vector<double> hu;
  for (int i = 0; i < kValues; ++i) {
    const double s = kFirst_mm + kStep_mm * i;
    hu.push_back(outside * (1.0 - phi((s - outer) / sigma)) +
                 cortex * (phi((s - outer) / sigma) - phi((s - outer - thickness) / sigma)) +
                 inside * phi((s - outer - thickness) / sigma));
  }
  return hu;
}

TEST(CortexProfile, ThicknessAndPlaceComeBack) {
  for (const double sigma : {0.6, 0.8, 1.0})
    for (const double thickness : {0.3, 0.5, 1.0, 1.5, 2.0, 3.0})
      for (const double outside : {-1000.0, 50.0}) {
        const auto hu = blurred(outside, 1600.0, 250.0, 0.13, thickness, sigma);
        const auto fit = fit_cortex({kFirst_mm, kStep_mm, hu}, sigma, 1600.0);
        ASSERT_TRUE(fit) << sigma << " " << thickness << " " << outside;
        EXPECT_NEAR(fit->profile.thickness_mm, thickness, 0.01) << sigma << " " << outside;
        EXPECT_NEAR(fit->profile.outer_mm, 0.13, 0.01) << sigma << " " << thickness << " " << outside;
        EXPECT_NEAR(fit->profile.outside_hu, outside, 3.0);
        EXPECT_NEAR(fit->profile.inside_hu, 250.0, 3.0) << sigma << " " << thickness << " " << outside;
        EXPECT_LT(fit->rest_hu, 1.0);
        EXPECT_NEAR(fit->profile.blurred_hu(0.2), hu[16], 2.0);
      }
}

// A wrong density of cortex leaves its mass for each area, above what surrounds it.
TEST(CortexProfile, ThinCortexKeepsItsMassIfItsDensityIsWrong) {
  const auto hu = blurred(50.0, 1600.0, 50.0, 0.0, 0.5, 0.8);
  const auto fit = fit_cortex({kFirst_mm, kStep_mm, hu}, 0.8, 1450.0);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->profile.thickness_mm * (1450.0 - 50.0), 0.5 * (1600.0 - 50.0), 0.02 * 0.5 * 1550.0);
}

TEST(CortexProfile, ThickCortexShowsItsDensity) {
  for (const double cortex : {1300.0, 1600.0, 1900.0}) {
    const auto hu = blurred(50.0, cortex, 250.0, 0.2, 3.0, 0.8);
    const auto fit = fit_thick_cortex({kFirst_mm, kStep_mm, hu}, 0.8, 1600.0);
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->profile.cortex_hu, cortex, 2.0);
    EXPECT_NEAR(fit->profile.thickness_mm, 3.0, 0.01);
  }
}

TEST(CortexProfile, NoiseMovesThicknessLittle) {
  std::minstd_rand random(3);
  std::normal_distribution<double> noise(0.0, 40.0);
  double sum = 0.0, squares = 0.0;
  constexpr int kTries = 200;
  for (int i = 0; i < kTries; ++i) {
    auto hu = blurred(50.0, 1600.0, 250.0, 0.0, 1.0, 0.8);
    for (double& h : hu) h += noise(random);
    const auto fit = fit_cortex({kFirst_mm, kStep_mm, hu}, 0.8, 1600.0);
    ASSERT_TRUE(fit);
    sum += fit->profile.thickness_mm / kTries;
    squares += fit->profile.thickness_mm * fit->profile.thickness_mm / kTries;
    EXPECT_NEAR(fit->rest_hu, 40.0, 20.0);
  }
  EXPECT_NEAR(sum, 1.0, 0.02);
  EXPECT_LT(std::sqrt(squares - sum * sum), 0.1);
}

TEST(CortexProfile, ALineWithoutCortexHasNone) {
  const std::vector<double> flat(kValues, 300.0), air(kValues, -1000.0);
  EXPECT_FALSE(fit_cortex({kFirst_mm, kStep_mm, flat}, 0.8, 1600.0));
  EXPECT_FALSE(fit_cortex({kFirst_mm, kStep_mm, air}, 0.8, 1600.0));
  EXPECT_FALSE(fit_cortex({kFirst_mm, kStep_mm, std::span(flat).first(5)}, 0.8, 1600.0));
}

TEST(CortexProfile, AnEdgeHasItsSigma) {
  for (const double sigma : {0.4, 0.8, 1.2}) {
    std::vector<double> hu;
    for (int i = 0; i < kValues; ++i) hu.push_back(-1000.0 + 1040.0 * phi((kFirst_mm + kStep_mm * i - 1.4) / sigma));
    const auto fit = fit_edge({kFirst_mm, kStep_mm, hu}, 0.7);
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->sigma_mm, sigma, 0.005);
    EXPECT_NEAR(fit->at_mm, 1.4, 0.005);
    EXPECT_NEAR(fit->low_hu, -1000.0, 1.0);
    EXPECT_NEAR(fit->high_hu, 40.0, 1.0);
  }
}

}  // namespace
}  // namespace osteon::imaging
