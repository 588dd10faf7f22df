// Apparent density from Hounsfield units.
#pragma once
#include <algorithm>

#include "common/volume/case.hpp"

namespace osteon::imaging {

// Density from Hounsfield units (Rho 1995). The authors measured human bone of many regions, and fitted one line for
// each bone and region. Finite element studies quote ρ = 131 + 1.067 HU kg/m³ as their line for cancellous bone of
// the proximal femur.
// [A] It is used here for all bone, also cortex, and for every scanner, kernel and tube voltage. Cortex is outside the
// densities of that fit: a scan of 1700 HU gives 1.94 g/cm³, while compact bone has 1.8 to 2.1.
inline constexpr DensityCalibration kRho1995{.slope_g_cm3_per_hu = 0.001067, .intercept_g_cm3 = 0.131};

// The usual preset for adult bone. The adult skull of invesalius-examples (1.5 mm slices) was segmented with it. The
// value fits a skull: thin cortex of other bones and cancellous bone may be below it.
inline constexpr double kBoneThreshold_hu = 226.0;

inline constexpr double kAir_hu = -1000.0;
// Compact bone is not denser (wet, apparent). Higher values in a scan are metal, enamel, or overshoot of a sharp
// kernel.
inline constexpr double kCompactBone_g_cm3 = 2.1;
// [A] Enamel is below it. Scanners with 12 bits cannot show more than 3071, and metal exceeds that.
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
