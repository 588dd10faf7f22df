#include "common/mechanics/point_force.hpp"

#include "common/mechanics/bone_strength.hpp"

namespace osteon {

double spring_damper_thrust_n(const SpringDamperParams& params, double feed_mm_per_s, double density_g_cm3) noexcept {
  if (!(feed_mm_per_s > 0.0)) return 0.0;
  return params.wear * relative_strength(density_g_cm3) * (params.spring_n + params.damper_n_s_per_mm * feed_mm_per_s);
}

double multi_point_feed_mm_per_s(const MultiPointParams& params, double force_n, double directed_density) noexcept {
  if (!(force_n > 0.0) || !(directed_density > 0.0)) return 0.0;
  return force_n / (params.wear * params.stiffness * directed_density);
}

}  // namespace osteon
