#include "common/mechanics/milling.hpp"

#include <algorithm>
#include <numbers>

#include "common/mechanics/bone_strength.hpp"
#include "common/mechanics/drilling.hpp"

namespace osteon {

double milling_resistance(const MillingParams& params, double projected_area_mm2, double axis_distance_mm,
                          double density_g_cm3) noexcept {
  const double arm_mm = std::max(axis_distance_mm, params.pole_radius * 0.5 * params.diameter_mm);
  return params.pressure_n_per_mm2 * relative_strength(density_g_cm3) * projected_area_mm2 / arm_mm;
}

Newtons milling_ploughing(const MillingParams& params, double edge_length_mm, GramsPerCm3 density) noexcept {
  return Newtons{params.wear * params.edge_n_per_mm * edge_length_mm * relative_strength(density.value())};
}

FeedLaw milling_law(const MillingParams& params, RevolutionsPerMinute speed, double resistance_sum,
                    double edge_length_mm, GramsPerCm3 density) noexcept {
  if (speed.value() < kMinCuttingRpm) return {};
  const double omega = speed.value() * 2.0 * std::numbers::pi / 60.0;
  return {.offset_n = milling_ploughing(params, edge_length_mm, density).value(),
          .scale_n = params.wear * resistance_sum / omega,
          .exponent = 1.0,
          .max_feed_mm_per_s = params.heel_mm_per_rev * speed.value() / 60.0,
          .threshold_n = 0.0};
}

Newtons milling_radial(const MillingParams& params, Newtons tangential_that_cuts) noexcept {
  return params.radial_ratio * tangential_that_cuts;
}

}  // namespace osteon
