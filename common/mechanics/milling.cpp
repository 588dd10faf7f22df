#include "common/mechanics/milling.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/mechanics/drilling.hpp"

namespace osteon {
namespace {
double relative_strength(double density_g_cm3) noexcept { return std::pow(std::max(0.0, density_g_cm3) / 1.9, 1.1841); }
}  // namespace

double milling_resistance(const MillingParams& params, double projected_area_mm2, double axis_distance_mm,
                          double density_g_cm3) noexcept {
  const double arm_mm = std::max(axis_distance_mm, params.pole_radius * 0.5 * params.diameter_mm);
  return params.wear * params.pressure_n_per_mm2 * relative_strength(density_g_cm3) * projected_area_mm2 / arm_mm;
}

FeedLaw milling_law(const MillingParams& params, RevolutionsPerMinute speed, double resistance_sum, GramsPerCm3 density,
                    double engaged) noexcept {
  if (speed.value() < kMinCuttingRpm) return {};
  const double omega = speed.value() * 2.0 * std::numbers::pi / 60.0;
  return {.scale_n = resistance_sum / omega,
          .exponent = 1.0,
          .max_feed_mm_per_s = 0.33 * params.diameter_mm * speed.value() / 60.0,
          .threshold_n = params.threshold_n * params.wear * engaged * relative_strength(density.value())};
}

NewtonMillimetres milling_torque(const MillingParams& params, Newtons tangential) noexcept {
  return NewtonMillimetres{tangential.value() * 0.5 * params.diameter_mm};
}

}  // namespace osteon
