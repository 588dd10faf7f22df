#include "common/mechanics/reaming.hpp"

#include <algorithm>

#include "common/mechanics/bone_strength.hpp"
#include "common/mechanics/drilling.hpp"

namespace osteon {
namespace {

double edge_n(const ReamingParams& p, double edge_length_mm, GramsPerCm3 density) noexcept {
  return p.wear * p.edge_n_per_mm * edge_length_mm * relative_strength(density.value());
}

// Force in N at 1 mm/s.
double chip_n(const ReamingParams& p, double rpm, double edge_length_mm, GramsPerCm3 density) noexcept {
  return p.wear * p.radial_ratio * p.pressure_n_per_mm2 * relative_strength(density.value()) * edge_length_mm * 60.0 /
         (rpm * p.teeth);
}

}  // namespace

FeedLaw reaming_law(const ReamingParams& params, RevolutionsPerMinute speed, double edge_length_mm,
                    GramsPerCm3 density) noexcept {
  if (speed.value() < kMinCuttingRpm || !(params.teeth > 0.0)) return {};
  return {.offset_n = edge_n(params, edge_length_mm, density),
          .scale_n = chip_n(params, speed.value(), edge_length_mm, density),
          .exponent = 1.0,
          .max_feed_mm_per_s = params.heel_mm_per_rev * speed.value() / 60.0,
          .threshold_n = 0.0};
}

NewtonMillimetres reaming_torque(const ReamingParams& params, Newtons thrust, double edge_length_mm,
                                 GramsPerCm3 density, double arm_mm) noexcept {
  const double ploughing_n = std::min(thrust.value(), edge_n(params, edge_length_mm, density));
  const double cutting_n = (thrust.value() - ploughing_n) / params.radial_ratio;
  return NewtonMillimetres{(cutting_n + ploughing_n) * arm_mm};
}

}  // namespace osteon
