// Stochastic part of a sound (Serra 1990): the residual as noise, by line segments over frequency in each frame.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace osteon::sound {

// One layer of noise: long frames resolve low frequencies, and short frames resolve time.
struct NoiseParams {
  int window = 256;               // samples of a frame, a power of two; frames are half of it apart
  int points = 32;                // of the line segments
  double from_hz = 0, to_hz = 0;  // bins in [from_hz, to_hz) are this layer's; to_hz is at most half of the rate
};

// Frame m has its middle at sample m * hop. Between two points the density is a line, in dB over Hz.
struct NoiseModel {
  double rate_hz = 0;
  NoiseParams params;
  std::vector<double> points_hz;  // from from_hz to to_hz
  std::size_t frames = 0;
  std::vector<float> levels_db;  // frames rows: power spectral density at each point, dB re full scale^2 / Hz

  [[nodiscard]] std::size_t hop() const { return static_cast<std::size_t>(params.window) / 2; }
};

// The points: at least a bin apart, and where there is room, in equal ratios.
[[nodiscard]] std::vector<double> noise_points_hz(double rate_hz, const NoiseParams& params);

// How many frames a sound of so many samples has.
[[nodiscard]] std::size_t noise_frames(std::size_t samples, const NoiseParams& params);

// A level is the mean power of the bins round a point, each with the share that the point's tent has there. `weight`:
// empty, or the factor that each sample of the residual has already been multiplied by, 0 to 1. Frames make up for it.
[[nodiscard]] NoiseModel noise_model(std::span<const float> residual, double rate_hz, const NoiseParams& params,
                                     std::span<const float> weight = {});

// Noise with these densities: spectra with random phases, through the inverse transform and overlap-add. The squares of
// the windows sum to one: independent frames add their powers. The same seed gives the same noise.
[[nodiscard]] std::vector<float> noise_sound(const NoiseModel& model, std::size_t samples, std::uint64_t seed);

}  // namespace osteon::sound
