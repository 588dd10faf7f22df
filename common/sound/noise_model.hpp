// Stochastic part of a sound (Serra 1990): the residual as noise, by line segments over frequency in each frame.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace osteon::sound {

struct NoiseParams {
  int window = 256;  // samples of a frame, a power of two; frames are half of it apart
  int points = 32;   // of the line segments
};

// Frame m has its middle at sample m * hop. Between two points the density is a line, in dB over Hz.
struct NoiseModel {
  double rate_hz = 0;
  int window = 256;
  std::vector<double> points_hz;  // from 0 to half of the rate
  std::size_t frames = 0;
  std::vector<float> levels_db;  // frames rows: power spectral density at each point, dB re full scale^2 / Hz

  [[nodiscard]] std::size_t hop() const { return static_cast<std::size_t>(window) / 2; }
};

// The points: one for each bin of a frame at first, then farther apart in equal ratios.
[[nodiscard]] std::vector<double> noise_points_hz(double rate_hz, const NoiseParams& params);

[[nodiscard]] NoiseModel noise_model(std::span<const float> residual, double rate_hz, const NoiseParams& params = {});

// Noise with these densities: spectra with random phases, through the inverse transform and overlap-add. Windows are
// sines, whose squares sum to one: independent frames add their powers. The same seed gives the same noise.
[[nodiscard]] std::vector<float> noise_sound(const NoiseModel& model, std::size_t samples, std::uint64_t seed);

}  // namespace osteon::sound
