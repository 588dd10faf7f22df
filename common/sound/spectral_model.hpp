// Spectral modelling synthesis (8.21 to 8.23; Serra 1990): a sound as partials, noise, and the samples of its impacts.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/sound/line_segments.hpp"
#include "common/sound/noise_model.hpp"
#include "common/sound/partials.hpp"
#include "common/sound/transients.hpp"

namespace osteon::sound {

struct SpectralParams {
  PartialParams partials;
  // Shorter partials sound like noise, and are kept as that: they would be half of the model.
  double kept_s = 0.06;
  SegmentTolerance tolerance;
  // Low tones are closer than short frames can tell, and blows shorter than long frames can tell.
  double noise_split_hz = 1160;  // between two bins of either layer at 22050 Hz
  NoiseParams low_noise{.window = 1024, .points = 32};
  NoiseParams high_noise{.window = 256, .points = 26};
  TransientParams transients;
};

// What is left of a sound when its phases are forgotten.
struct SpectralModel {
  double rate_hz = 0;
  std::size_t samples = 0;
  int hop = 128;                            // samples between the frames of the partials
  std::vector<std::vector<Knot>> partials;  // each with one knot or more
  std::vector<NoiseModel> noise;            // layers, which add up
  std::vector<Transient> transients;
};

// x = sines + residual: exact but for the rounding of the last bit of each sample.
struct SpectralAnalysis {
  std::vector<std::size_t> impacts;  // samples
  std::vector<Partial> partials;     // with the phases of the frames
  std::vector<float> sines;          // the partials' sound with these phases
  std::vector<float> residual;       // in time
  std::vector<float> kept_sines;     // of the partials that the model keeps; its noise has the rest
  SpectralModel model;
};

[[nodiscard]] SpectralAnalysis spectral_analysis(std::span<const float> samples, double rate_hz,
                                                 const SpectralParams& params = {});
// The same; minutes of sound take a while. Error cancelled: `keep_going` stopped it.
[[nodiscard]] Result<SpectralAnalysis> spectral_analysis(std::span<const float> samples, double rate_hz,
                                                         const SpectralParams& params, const KeepGoing& keep_going);

// s(t) = sum over the partials of A(t) cos(theta(t)) + e(t) (8.21 to 8.23): oscillators, whose phases begin at random,
// noise, and the impacts in place of both. The same seed gives the same sound.
[[nodiscard]] std::vector<float> resynthesised(const SpectralModel& model, std::uint64_t seed);

// The noise alone.
[[nodiscard]] std::vector<float> resynthesised_noise(const SpectralModel& model, std::uint64_t seed);

}  // namespace osteon::sound
