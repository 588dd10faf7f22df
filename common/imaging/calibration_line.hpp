// Fits the line from Hounsfield units to density through readings of known materials (Niu 2008, eq. 3.1).
#pragma once
#include <span>

#include "common/core/result.hpp"
#include "common/volume/case_description.hpp"

namespace osteon::imaging {

// What a scan shows of a material whose density is known.
struct DensityReading {
  double density_g_cm3 = 0.0;
  double hu = 0.0;
};

// H = k · density + a by least squares, because the densities are known and the HU are measured.
struct CalibrationLine {
  double hu_per_g_cm3 = 0.0;   // k
  double hu_of_nothing = 0.0;  // a
  double deviation_hu = 0.0;   // standard deviation of a reading from the line; 0 with two readings
  int readings = 0;
  double mean_g_cm3 = 0.0, squares = 0.0;  // of the readings' densities: mean, and sum of squared differences from it

  [[nodiscard]] DensityCalibration calibration() const { return {1.0 / hu_per_g_cm3, -hu_of_nothing / hu_per_g_cm3}; }
  // Standard error of the density that the line gives one more reading at this density. It grows with the distance from
  // the readings. Two readings say nothing of it: then it is 0.
  [[nodiscard]] double error_g_cm3(double density_g_cm3) const;
};

// Error: invalid_input (fewer than two densities, or HU that do not rise with them).
[[nodiscard]] Result<CalibrationLine> fit_calibration(std::span<const DensityReading> readings);

}  // namespace osteon::imaging
