#include "common/mechanics/allotta.hpp"

#include <cmath>

#include "common/mechanics/bone_strength.hpp"

namespace osteon {

double allotta_energy_mj_per_mm3(const AllottaParams& params, GramsPerCm3 density) noexcept {
  return params.wear * params.energy_ratio * ultimate_stress_mpa(density.value(), params.ultimate_mpa);
}

Newtons allotta_thrust(const AllottaParams& params, double feed_mm_per_rev, GramsPerCm3 density) noexcept {
  if (!(feed_mm_per_rev > 0.0)) return Newtons{0.0};
  return Newtons{allotta_energy_mj_per_mm3(params, density) * feed_mm_per_rev * 0.5 * params.diameter_mm *
                 std::sin(0.5 * params.point_angle_rad)};
}

}  // namespace osteon
