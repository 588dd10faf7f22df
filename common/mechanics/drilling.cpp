#include "common/mechanics/drilling.hpp"

#include <cmath>

namespace osteon {
namespace {

constexpr double kChiScale = 134.6, kChiSpeed = -0.3327, kChiFeed = 0.5189, kChiDensity = 1.1841;
constexpr double kReferenceDensity = 1.9;

double scale_n(const DrillingParams& p, double rpm, double density_g_cm3) noexcept {
  return kChiScale * std::pow(rpm, kChiSpeed) * std::pow(density_g_cm3, kChiDensity) * p.wear *
         (p.diameter_mm / kReferenceDiameter_mm);
}

}  // namespace

NewtonMillimetres drilling_torque(const DrillingParams& params, Newtons thrust) noexcept {
  return NewtonMillimetres{thrust.value() * params.diameter_mm / (4.0 * std::sin(0.5 * params.point_angle_rad))};
}

FeedLaw drilling_law(const DrillingParams& params, RevolutionsPerMinute speed, GramsPerCm3 density,
                     double engaged) noexcept {
  if (speed.value() < kMinCuttingRpm) return {};
  const double rho = density.value() > 0.0 ? density.value() : 0.0;
  return {.scale_n = engaged * scale_n(params, speed.value(), rho),
          .exponent = kChiFeed,
          .max_feed_mm_per_s = params.heel_mm_per_rev * speed.value() / 60.0,
          .threshold_n = params.threshold_n * params.wear * engaged * (params.diameter_mm / kReferenceDiameter_mm) *
                         std::pow(rho / kReferenceDensity, kChiDensity)};
}

}  // namespace osteon
