#include "audio_client/synth/handpiece.hpp"

#include <cmath>

#include "common/core/check.hpp"
#include "common/sound/gearbox.hpp"

namespace osteon::audio {
namespace {

// RMS of the free-running partials at rated speed, relative to full scale. -32 dB leaves room for the load and for
// other tools.
constexpr double kFreeLevel = 0.025;

Handpiece geared_drill() {
  constexpr sound::Gearbox gears;
  Handpiece drill{.kind = HandpieceKind::geared_drill, .teeth = 2, .rated_rpm = 1400, .air_level = 1.4, .partials = {}};
  auto& p = drill.partials;

  // Unbalance of the three shafts.
  p.push_back({1, Source::shaft, 0.10});
  p.push_back({2, Source::shaft, 0.10});
  p.push_back({gears.transfer(), Source::shaft, 0.12});
  p.push_back({gears.motor(), Source::shaft, 0.20});
  p.push_back({2 * gears.motor(), Source::shaft, 0.10});

  // Commutation: the third harmonic is the loudest line of the free-running drill (8.5.4: 5500 Hz, magnetic pole pass).
  const double commutation = sound::kCommutatorSegments * gears.motor();
  const double commutation_levels[] = {0.30, 0.10, 1.00, 0.12};
  for (int i = 0; i < 4; ++i) p.push_back({(i + 1) * commutation, Source::motor, commutation_levels[i]});
  for (const int side : {-1, 1}) p.push_back({3 * commutation + side * gears.motor(), Source::motor, 0.18});

  // Meshes with the sidebands n f_mesh +- k f_spin; low orders dominate (8.5.2).
  const double output_levels[] = {0.45, 0.40, 0.25, 0.16, 0.06, 0.35};
  for (int n = 0; n < 6; ++n) p.push_back({(n + 1) * gears.output_mesh(), Source::output_mesh, output_levels[n]});
  for (const int side : {-2, -1, 1, 2}) {
    p.push_back(
        {gears.output_mesh() + side * gears.output_spin(), Source::output_mesh, side * side == 1 ? 0.14 : 0.06});
  }
  p.push_back({gears.motor_mesh(), Source::motor_mesh, 0.72});
  p.push_back({2 * gears.motor_mesh(), Source::motor_mesh, 0.10});
  for (const int side : {-2, -1, 1, 2}) {
    p.push_back({gears.motor_mesh() + side * gears.motor_spin(), Source::motor_mesh, side * side == 1 ? 0.20 : 0.08});
  }

  // The flutes: they fill 0-400 Hz while cutting (8.5.4).
  for (int k = 1; k <= 12; ++k) p.push_back({static_cast<double>(k * drill.teeth), Source::tooth, 1.0 / std::sqrt(k)});
  return drill;
}

Handpiece direct_burr() {
  Handpiece burr{.kind = HandpieceKind::direct_burr, .teeth = 8, .rated_rpm = 40000, .air_level = 1.0, .partials = {}};
  auto& p = burr.partials;
  const double shaft_levels[] = {1.00, 0.35, 0.20, 0.10};
  for (int k = 0; k < 4; ++k) p.push_back({k + 1.0, Source::shaft, shaft_levels[k]});
  // A brushless motor with one pole pair steps six times per turn.
  p.push_back({6, Source::motor, 0.50});
  p.push_back({12, Source::motor, 0.15});
  // The bearings' cage turns a little slower than half of the shaft and beats with it.
  p.push_back({0.4, Source::shaft, 0.08});
  p.push_back({0.6, Source::shaft, 0.06});
  p.push_back({1.4, Source::shaft, 0.08});
  // Flutes with an unevenness once per turn: sidebands at the shaft's frequency.
  for (int k = 1; k <= 4; ++k) p.push_back({static_cast<double>(k * burr.teeth), Source::tooth, 0.9 / k});
  for (const int side : {-1, 1}) p.push_back({static_cast<double>(burr.teeth + side), Source::tooth, 0.30});
  for (int k = 1; k <= 3; ++k) p.push_back({static_cast<double>(k), Source::tooth, 0.4});
  return burr;
}

}  // namespace

double radiation(double hz) noexcept {
  const double low = hz * hz / (hz * hz + 200.0 * 200.0);
  return low / (1.0 + (hz / 7000.0) * (hz / 7000.0));
}

Handpiece make_handpiece(HandpieceKind kind) {
  Handpiece piece = kind == HandpieceKind::geared_drill ? geared_drill() : direct_burr();
  OSTEON_CHECK(piece.partials.size() <= kMaxPartials);
  double mean_square = 0;
  for (const Partial& p : piece.partials) {
    const double radiated = p.level * radiation(p.ratio * piece.rated_rpm / 60.0);
    if (p.source != Source::tooth) mean_square += 0.5 * radiated * radiated;
  }
  const double scale = kFreeLevel / std::sqrt(mean_square);
  for (Partial& p : piece.partials) p.level *= scale;
  piece.air_level *= kFreeLevel;
  return piece;
}

}  // namespace osteon::audio
