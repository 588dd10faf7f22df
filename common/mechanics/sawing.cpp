#include "common/mechanics/sawing.hpp"

#include <numbers>

#include "common/mechanics/bone_strength.hpp"
#include "common/mechanics/drilling.hpp"

namespace osteon {
namespace {

constexpr double kLow_um = 2.0, kSpan_um = 8.0;

double tooth_n(const SawingParams& p, GramsPerCm3 density) noexcept {
  return p.wear * p.thrust_n * relative_strength(density.value());
}

}  // namespace

Newtons tooth_thrust(const SawingParams& params, double depth_um, GramsPerCm3 density) noexcept {
  return Newtons{tooth_n(params, density) * (1.0 + params.rise * (depth_um - kLow_um) / kSpan_um)};
}

Newtons tooth_cutting_force(const SawingParams& params, GramsPerCm3 density) noexcept {
  return Newtons{params.wear * params.cutting_n * relative_strength(density.value())};
}

MillimetresPerSecond tooth_speed(const SawingParams& params, RevolutionsPerMinute strokes) noexcept {
  return MillimetresPerSecond{2.0 * params.stroke_mm * strokes.value() / 60.0};
}

double depth_of_cut_um(const SawingParams& params, RevolutionsPerMinute strokes, MillimetresPerSecond feed) noexcept {
  const double speed = tooth_speed(params, strokes).value();
  return speed > 0.0 ? 1e3 * feed.value() * params.tooth_pitch_mm / (params.bearing_share * speed) : 0.0;
}

FeedLaw sawing_law(const SawingParams& params, RevolutionsPerMinute strokes, GramsPerCm3 density,
                   double teeth) noexcept {
  const double um_per_feed = depth_of_cut_um(params, strokes, MillimetresPerSecond{1.0});
  if (strokes.value() < kMinCuttingRpm || !(um_per_feed > 0.0) || !(teeth > 0.0)) return {};
  const double bearing_n = params.bearing_share * teeth * tooth_n(params, density);
  return {.offset_n = bearing_n * (1.0 - params.rise * kLow_um / kSpan_um),
          .scale_n = bearing_n * params.rise / kSpan_um * um_per_feed,
          .exponent = 1.0,
          .max_feed_mm_per_s = params.most_um / um_per_feed,
          .threshold_n = 0.0};
}

Newtons sawing_cutting_force(const SawingParams& params, GramsPerCm3 density, double teeth) noexcept {
  return params.bearing_share * teeth * tooth_cutting_force(params, density);
}

NewtonMillimetres sawing_torque(const SawingParams& params, GramsPerCm3 density, double teeth) noexcept {
  return NewtonMillimetres{sawing_cutting_force(params, density, teeth).value() * params.stroke_mm / std::numbers::pi};
}

}  // namespace osteon
