// Signals whose spectra are known in closed form.
#pragma once
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <span>
#include <vector>

namespace osteon::sound {

inline constexpr double kAnalysed_hz = 22050;  // the rate at which 8.5.4 analyses

inline std::vector<float> tone(double hz, double amplitude, std::size_t count, double rate_hz) {
  std::vector<float> samples(count);
  for (std::size_t i = 0; i < count; ++i)
    samples[i] =
        static_cast<float>(amplitude * std::sin(2.0 * std::numbers::pi * hz * static_cast<double>(i) / rate_hz));
  return samples;
}

// White Gaussian noise with this RMS.
inline std::vector<float> white_noise(double rms, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0.0F, static_cast<float>(rms));
  std::vector<float> samples(count);
  for (float& x : samples) x = normal(random);
  return samples;
}

inline std::vector<float> added(std::vector<float> a, std::span<const float> b) {
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) a[i] += b[i];
  return a;
}

inline std::vector<float> differences(std::vector<float> a, std::span<const float> b) {
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) a[i] -= b[i];
  return a;
}

inline double energy(std::span<const float> samples) {
  double sum = 0;
  for (const float x : samples) sum += static_cast<double>(x) * x;
  return sum;
}

inline double mean_square(std::span<const float> samples) {
  return energy(samples) / static_cast<double>(samples.size());
}

}  // namespace osteon::sound
