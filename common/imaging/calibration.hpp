// Apparent density from Hounsfield units.
#pragma once
#include <algorithm>

#include "common/volume/case.hpp"

namespace osteon::imaging {

// Rho, Hobatho, Ashman: Relations of mechanical properties to density and CT numbers in human bone. Medical
// Engineering & Physics 17(5), 1995, 347-355: ρ = 131 + 1.067 HU kg/m³ (femoral cortex).
// [A] Assumed for every scan without a calibration phantom: the true line depends on scanner, kernel and kV.
inline constexpr DensityCalibration kRho1995{.slope_g_cm3_per_hu = 0.001067, .intercept_g_cm3 = 0.131};

// The usual preset for adult bone, and the one with which the skull of invesalius-examples was segmented.
inline constexpr double kBoneThreshold_hu = 226.0;

inline constexpr double kAir_hu = -1000.0;

[[nodiscard]] inline double density_g_cm3(const DensityCalibration& line, double hu) {
  return std::max(0.0, line.intercept_g_cm3 + line.slope_g_cm3_per_hu * hu);
}
// The inverse, for phantoms.
[[nodiscard]] inline double hounsfield(const DensityCalibration& line, double density_g_cm3) {
  return (density_g_cm3 - line.intercept_g_cm3) / line.slope_g_cm3_per_hu;
}

}  // namespace osteon::imaging
