#include "common/mechanics/broaching.hpp"

#include <algorithm>

#include "common/mechanics/bone_strength.hpp"

namespace osteon {
namespace {

// Energy of a blow, N mm.
double blow_energy_nmm(const BroachingParams& params) noexcept {
  return 1e3 * params.efficiency * params.impulse_n_s * params.impulse_n_s / (2.0 * params.mallet_kg);
}

}  // namespace

Newtons broaching_resistance(const BroachingParams& params, double engaged_area_mm2, GramsPerCm3 density) noexcept {
  return Newtons{params.wear * ultimate_stress_mpa(density.value(), params.crushing_mpa) * engaged_area_mm2};
}

double blow_advance_mm(const BroachingParams& params, double engaged_area_mm2, GramsPerCm3 density) noexcept {
  const double resistance_n = broaching_resistance(params, engaged_area_mm2, density).value();
  const double energy = blow_energy_nmm(params);
  if (energy < params.seated_mm * resistance_n) return 0.0;
  return resistance_n > 0.0 ? std::min(energy / resistance_n, params.most_mm) : params.most_mm;
}

double seating(const BroachingParams& params, double engaged_area_mm2, GramsPerCm3 density) noexcept {
  const double resistance_n = broaching_resistance(params, engaged_area_mm2, density).value();
  return std::clamp(params.seated_mm * resistance_n / blow_energy_nmm(params), 0.0, 1.0);
}

FeedLaw broaching_law(const BroachingParams& params, RevolutionsPerMinute blows, double engaged_area_mm2,
                      GramsPerCm3 density) noexcept {
  const double feed = blow_advance_mm(params, engaged_area_mm2, density) * blows.value() / 60.0;
  if (!(feed > 0.0)) return {};
  return {
      .offset_n = 0.0, .scale_n = params.hold_n / feed, .exponent = 1.0, .max_feed_mm_per_s = feed, .threshold_n = 0.0};
}

}  // namespace osteon
