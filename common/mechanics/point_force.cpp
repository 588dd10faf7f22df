#include "common/mechanics/point_force.hpp"

#include <algorithm>

#include "common/mechanics/bone_strength.hpp"

namespace osteon {

Vec3 spring_damper_force_n(const SpringDamperParams& params, const Vec3& velocity_mm_per_s, const Vec3& normal,
                           double density_g_cm3) noexcept {
  const double strength = params.wear * relative_strength(density_g_cm3);
  const double length = normal.norm();
  Vec3 force = -params.damper_n_s_per_mm * strength * velocity_mm_per_s;
  if (length > 1e-9) force += params.spring_n * strength / length * normal;
  return force;
}

double spring_damper_thrust_n(const SpringDamperParams& params, double feed_mm_per_s, double density_g_cm3) noexcept {
  if (!(feed_mm_per_s > 0.0)) return 0.0;
  return params.wear * relative_strength(density_g_cm3) * (params.spring_n + params.damper_n_s_per_mm * feed_mm_per_s);
}

double spring_damper_feed_mm_per_s(const SpringDamperParams& params, double force_n, double density_g_cm3) noexcept {
  const double strength = params.wear * relative_strength(density_g_cm3);
  if (!(strength > 0.0)) return 0.0;
  return std::max(0.0, (force_n / strength - params.spring_n) / params.damper_n_s_per_mm);
}

Vec3 multi_point_force_n(const MultiPointParams& params, std::span<const CuttingPoint> points) noexcept {
  Vec3 sum = Vec3::Zero();
  for (const CuttingPoint& point : points)
    if (point.inward.dot(point.velocity_mm_per_s) < 0.0)
      sum += params.wear * params.stiffness * point.share * point.density_g_cm3 * point.velocity_mm_per_s.norm() * point.inward;
  return sum;
}

double multi_point_feed_mm_per_s(const MultiPointParams& params, double force_n, double directed_density) noexcept {
  if (!(force_n > 0.0) || !(directed_density > 0.0)) return 0.0;
  return force_n / (params.wear * params.stiffness * directed_density);
}

}  // namespace osteon
