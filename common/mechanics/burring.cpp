#include "common/mechanics/burring.hpp"

#include <cmath>
#include <numbers>

#include "common/mechanics/bone_strength.hpp"

namespace osteon {

Newtons agus_elastic_force(const AgusParams& params, double depth_mm) noexcept {
  if (!(depth_mm > 0.0)) return Newtons{0.0};
  const double ratio = depth_mm / params.radius_mm;
  return Newtons{params.elastic_n_per_mm2 * params.radius_mm * params.radius_mm * ratio * std::sqrt(ratio)};
}

double agus_depth_mm(const AgusParams& params, Newtons force) noexcept {
  if (!(force.value() > 0.0)) return 0.0;
  const double ratio = force.value() / (params.elastic_n_per_mm2 * params.radius_mm * params.radius_mm);
  return params.radius_mm * std::cbrt(ratio * ratio);
}

Newtons agus_friction(const AgusParams& params, Newtons normal, double axis_distance_mm) noexcept {
  const double contact_mm = std::sqrt(agus_depth_mm(params, normal) * params.radius_mm);  // Hertz: a^2 = h R
  if (!(contact_mm > 0.0)) return Newtons{0.0};
  const double away = axis_distance_mm / contact_mm;
  // The fraction of the pressure's friction that points along omega x r at the contact's middle. Far from the pole it
  // is 1 - <s^2>/(4 d^2) with Hertz's mean <s^2> = 2/5 a^2.
  double share = 1.0 - 0.1 / (away * away);
  if (away < 4.0) {
    // Sum over rings s of the disc, each weighted by its length and Hertz's pressure, sqrt(1 - (s/a)^2).
    constexpr int kRings = 8, kPlaces = 24;
    double sum = 0.0, weights = 0.0;
    for (int i = 0; i < kRings; ++i) {
      const double s = (i + 0.5) / kRings, weight = s * std::sqrt(1.0 - s * s);
      for (int k = 0; k < kPlaces; ++k) {
        const double angle = 2.0 * std::numbers::pi * (k + 0.5) / kPlaces;
        const double x = away + s * std::cos(angle), y = s * std::sin(angle), r = std::hypot(x, y);
        if (r > 0.0) sum += weight * x / r;
      }
      weights += weight * kPlaces;
    }
    share = sum / weights;
  }
  return Newtons{params.friction * normal.value() * share};
}

MillimetresPerSecond agus_erosion(const AgusParams& params, RevolutionsPerMinute speed, Newtons force,
                                  double axis_distance_mm, double area_mm2, GramsPerCm3 density) noexcept {
  const double energy = params.wear * params.energy_n_per_mm2 * relative_strength(density.value());
  if (!(force.value() > 0.0) || !(area_mm2 > 0.0) || !(energy > 0.0) ||
      axis_distance_mm < params.pole_radius * params.radius_mm)
    return MillimetresPerSecond{0.0};
  const double omega = speed.value() * 2.0 * std::numbers::pi / 60.0;
  return MillimetresPerSecond{params.friction * force.value() * omega * axis_distance_mm / (energy * area_mm2)};
}

}  // namespace osteon
