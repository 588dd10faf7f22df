#include "audio_client/synth/handpiece.hpp"

#include <algorithm>
#include <cmath>

#include "audio_client/synth/resonances.hpp"
#include "common/core/check.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/resample.hpp"
#include "common/sound/transients.hpp"
#include "common/tools/tool.hpp"

namespace osteon::audio {
namespace {

using sound::amplitude_of_db;

constexpr double kHardest_g_cm3 = 1.9;  // of ToolSound's hardness 1
constexpr double kMostLoad = 1.5;       // of a material's own

}  // namespace

double radiation(double hz) noexcept {
  const double low = hz * hz / (hz * hz + 200.0 * 200.0);
  return low / (1.0 + (hz / 7000.0) * (hz / 7000.0));
}

SpindleParams at_spindle(const Motor& motor, double rated_rpm) {
  const double torque_ratio = motor.reduction * motor.efficiency;
  // J times the droop, with J in kg m^2 and the droop in rad/s per N m.
  const double response_s = 1e-7 * motor.inertia_g_cm2 * motor.droop_rpm_per_Nmm * 1e3 * 0.10471975511965977;
  return {.full_rpm = rated_rpm,
          .run_up_s = motor.run_up_s,
          .droop_rpm_per_nmm = motor.droop_rpm_per_Nmm / (motor.reduction * torque_ratio),
          .most_nmm = motor.most_Nmm * torque_ratio,
          .response_s = response_s};
}

Gains material_gains(const ToolModel& model, double load, double hardness, double perforated) noexcept {
  const Material &soft = model.cancellous, &hard = model.cortical;
  const double density = hardness * kHardest_g_cm3;
  const double way = std::clamp((density - soft.density_g_cm3) / (hard.density_g_cm3 - soft.density_g_cm3), 0.0, 1.0);
  const double softer = std::clamp(density / soft.density_g_cm3, 0.0, 1.0);  // than the softest of the table
  const double part = softer * std::clamp(load / std::lerp(soft.load, hard.load, way), 0.0, kMostLoad);
  Gains gains;
  for (std::size_t s = 0; s < gains.source.size(); ++s) {
    const bool teeth = static_cast<LineSource>(s) == LineSource::teeth;
    const double full =
        amplitude_of_db(std::lerp(applied_change(soft.change_db[s]), applied_change(hard.change_db[s]), way));
    const double through = amplitude_of_db(applied_change(model.perforation.change_db[s]));
    // Teeth sound only while they cut.
    const double cut = teeth ? part * full : 1.0 + part * (full - 1.0);
    gains.source[s] = std::max({0.0, cut, perforated * through});
  }
  const double noise = amplitude_of_db(std::lerp(applied_change(soft.noise_db), applied_change(hard.noise_db), way));
  gains.noise = std::max(0.0, 1.0 + part * (noise - 1.0));
  return gains;
}

Handpiece make_handpiece(const ToolModel& model, const Tool* tool, double rate_hz) {
  OSTEON_CHECK(model.lines.size() <= kMostLines && model.blow.modes.size() <= kMostModes &&
               model.perforation.burst.size() <= kMostModes);
  Handpiece piece;
  piece.model = model;
  piece.teeth = model.teeth > 0 ? model.teeth : tool && tool->teeth > 0 ? tool->teeth : 2;
  for (const Line& line : model.lines) {
    const double ratio = line.order + line.teeth * piece.teeth;
    if (ratio <= 0) continue;  // a sideband below a tool's only tooth
    piece.partials.push_back({.ratio = ratio,
                              .source = line.source,
                              .level = amplitude_of_db(line.level_db),
                              .rated_gain = std::max(1e-6, radiation(ratio * model.rated_rpm / 60.0))});
  }
  piece.spindle = at_spindle(model.motor, model.rated_rpm);
  piece.noise.prepare(model.noise, rate_hz);
  const BladeParams& blade = model.blade;
  double length_mm = blade.length_mm, thickness_mm = blade.thickness_mm;
  if (tool && tool->thickness_mm > 0 && model.drive == Drive::strokes) {
    length_mm = tool->reach_mm();
    thickness_mm = tool->thickness_mm;
  }
  if (length_mm > 0 && thickness_mm > 0)
    for (int m = 0; m < kBladeModes; ++m)
      piece.blade_hz[static_cast<std::size_t>(m)] = beam_mode_hz(m, length_mm, thickness_mm);
  for (const std::vector<float>& transient : model.transients) {
    piece.clicks.push_back(sound::resampled(transient, kPresetTransientRate_hz, static_cast<int>(rate_hz)));
    piece.click_weights.push_back(sound::transient_weight(piece.clicks.back().size(), rate_hz));
  }
  return piece;
}

}  // namespace osteon::audio
