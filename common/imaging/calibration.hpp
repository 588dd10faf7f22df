// Apparent density from Hounsfield units.
#pragma once
#include <algorithm>

#include "common/volume/case.hpp"

namespace osteon::imaging {

using osteon::kRho1995;
// [A] Standard errors of that line for another scanner and another bone.
inline constexpr double kRhoCancellousError_g_cm3 = 0.1, kRhoCorticalError_g_cm3 = 0.2;

// The densities at which the error of a calibration is stated: healthy cancellous bone of a femur's head, and cortex.
inline constexpr double kCancellous_g_cm3 = 0.4, kCortical_g_cm3 = 1.85;

// The usual preset for adult bone. The adult skull of invesalius-examples (1.5 mm slices) was segmented with it. The
// value fits a skull: thin cortex of other bones and cancellous bone may be below it.
inline constexpr double kBoneThreshold_hu = 226.0;

inline constexpr double kAir_hu = -1000.0;
// Compact bone is not denser (wet, apparent). Higher values in a scan are metal, enamel, or overshoot of a sharp
// kernel.
inline constexpr double kCompactBone_g_cm3 = 2.1;
// [A] The usual limit. Enamel is below it. Scanners with 12 bits cannot show more than 3071, and metal exceeds that.
inline constexpr double kMetal_hu = 3000.0;

[[nodiscard]] inline double density_g_cm3(const DensityCalibration& line, double hu) {
  return std::max(0.0, line.intercept_g_cm3 + line.slope_g_cm3_per_hu * hu);
}
// The same for bone, limited to the density of compact bone.
[[nodiscard]] inline double bone_density_g_cm3(const DensityCalibration& line, double hu) {
  return std::min(kCompactBone_g_cm3, density_g_cm3(line, hu));
}
// The inverse, for phantoms.
[[nodiscard]] inline double hounsfield(const DensityCalibration& line, double density_g_cm3) {
  return (density_g_cm3 - line.intercept_g_cm3) / line.slope_g_cm3_per_hu;
}

}  // namespace osteon::imaging
