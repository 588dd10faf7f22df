// How the resistance of bone to cutting grows with its density, relative to cortical bone.
#pragma once
#include <cmath>

namespace osteon {

inline constexpr double kCorticalDensity = 1.9;  // g/cm3

// [haptic] Like the thrust of drilling, equation (7.3): (density / 1.9)^1.1841. [A] for every other way of cutting.
[[nodiscard]] inline double relative_strength(double density_g_cm3) noexcept {
  return density_g_cm3 > 0.0 ? std::pow(density_g_cm3 / kCorticalDensity, 1.1841) : 0.0;
}

// [haptic] Ultimate stress in MPa = N/mm2: 130 (density / 1.9)^2 [A].
[[nodiscard]] inline double ultimate_stress_mpa(double density_g_cm3, double cortical_mpa = 130.0) noexcept {
  const double ratio = density_g_cm3 > 0.0 ? density_g_cm3 / kCorticalDensity : 0.0;
  return cortical_mpa * ratio * ratio;
}

}  // namespace osteon
