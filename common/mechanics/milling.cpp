#include "common/mechanics/milling.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/mechanics/bone_strength.hpp"
#include "common/mechanics/drilling.hpp"

namespace osteon {
namespace {

double edge_force_n(const MillingParams& p, const MilledFace& face) noexcept {
  return p.wear * p.edge_n_per_mm * face.edge_length_mm * relative_strength(face.density.value());
}

// N·s/mm.
double face_resistance(const MillingParams& p, RevolutionsPerMinute speed, const MilledFace& face) noexcept {
  return milling_resistance(p, face.area_mm2, face.axis_distance_mm, face.density.value()) /
         (speed.value() * 2.0 * std::numbers::pi / 60.0);
}

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

Newtons milling_tangential(const MillingParams& params, RevolutionsPerMinute speed, MillimetresPerSecond feed,
                           const MilledFace& face) noexcept {
  if (speed.value() < kMinCuttingRpm || !(feed.value() > 0.0)) return Newtons{0.0};
  return Newtons{edge_force_n(params, face) + face_resistance(params, speed, face) * feed.value()};
}

MillimetresPerSecond milling_feed(const MillingParams& params, RevolutionsPerMinute speed, Newtons tangential,
                                  const MilledFace& face) noexcept {
  const double cutting_n = tangential.value() - edge_force_n(params, face);
  if (speed.value() < kMinCuttingRpm || !(cutting_n > 0.0)) return MillimetresPerSecond{0.0};
  const double resistance = face_resistance(params, speed, face);
  return MillimetresPerSecond{resistance > 0.0 ? cutting_n / resistance : 0.0};
}

Newtons milling_radial(const MillingParams& params, Newtons tangential_that_cuts) noexcept {
  return params.radial_ratio * tangential_that_cuts;
}

}  // namespace osteon
