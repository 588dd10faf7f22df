#include "common/imaging/calibration_line.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace osteon::imaging {
namespace {

TEST(CalibrationLine, GoesThroughReadingsOfALine) {
  // H = 1250 rho - 20, so rho = 0.016 + 0.0008 H.
  const std::vector<DensityReading> readings{{0.2, 230.0}, {0.0, -20.0}, {0.8, 980.0}, {0.4, 480.0}};
  const auto line = fit_calibration(readings);
  ASSERT_TRUE(line);
  EXPECT_NEAR(line->calibration().slope_g_cm3_per_hu, 0.0008, 1e-12);
  EXPECT_NEAR(line->calibration().intercept_g_cm3, 0.016, 1e-12);
  EXPECT_NEAR(line->error_g_cm3(1.85), 0.0, 1e-12);
}

// The deviations +10, -20, +10 are orthogonal to every line over -1, 0, 1. So they leave the line where it is, and the
// sum of their squares is that of the residuals: s = sqrt(600 / (3 - 2)).
TEST(CalibrationLine, TheErrorOfItsPredictionIsThatOfTheTextbook) {
  const std::vector<DensityReading> readings{{0.0, 10.0}, {1.0, 980.0}, {2.0, 2010.0}};
  const auto line = fit_calibration(readings);
  ASSERT_TRUE(line);
  EXPECT_NEAR(line->hu_per_g_cm3, 1000.0, 1e-9);
  EXPECT_NEAR(line->hu_of_nothing, 0.0, 1e-9);
  EXPECT_NEAR(line->deviation_hu, std::sqrt(600.0), 1e-9);
  EXPECT_NEAR(line->error_g_cm3(1.0), std::sqrt(600.0) / 1000.0 * std::sqrt(4.0 / 3.0), 1e-12);
  EXPECT_NEAR(line->error_g_cm3(3.0), std::sqrt(600.0) / 1000.0 * std::sqrt(4.0 / 3.0 + 2.0), 1e-12);
}

TEST(CalibrationLine, NeedsTwoDensitiesAndRisingHu) {
  EXPECT_FALSE(fit_calibration({}));
  const std::vector<DensityReading> one{{0.2, 230.0}, {0.2, 235.0}};
  EXPECT_FALSE(fit_calibration(one));
  const std::vector<DensityReading> falling{{0.0, 100.0}, {0.2, 50.0}};
  const auto refused = fit_calibration(falling);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace osteon::imaging
