#include "audio_client/synth/noise_bank.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace osteon::audio {
namespace {

constexpr int kRounds = 40;

// Response of a band at `hz`, from the trapezoidal rule, which bends the scale of frequencies.
std::complex<double> response(double hz, double centre_hz, double quality, double rate_hz) {
  const double x = std::tan(std::numbers::pi * hz / rate_hz) / std::tan(std::numbers::pi * centre_hz / rate_hz);
  const std::complex<double> s(0.0, x);
  return s / quality / (s * s + s / quality + 1.0);
}

}  // namespace

void NoiseBank::prepare(const std::vector<NoisePoint>& points, double rate_hz) {
  *this = NoiseBank{};
  std::array<double, kMostNoisePoints> hz{}, quality{}, wanted{}, gain{};
  for (const NoisePoint& point : points)
    if (point.hz < 0.42 * rate_hz) {
      hz[count_] = point.hz;
      // Of white noise with the variance v, the density is 2 v / rate.
      wanted[count_] = std::sqrt(std::pow(10.0, 0.1 * point.db_per_hz) * rate_hz / (2.0 * kWhiteVariance));
      ++count_;
    }
  for (std::size_t i = 0; i < count_; ++i) {
    const double low = i > 0 ? hz[i - 1] : hz[i] * hz[i] / hz[std::min(i + 1, count_ - 1)];
    const double high = i + 1 < count_ ? hz[i + 1] : hz[i] * hz[i] / hz[i > 0 ? i - 1 : 0];
    const double ratio = std::clamp(std::sqrt(high / low), 1.05, 8.0);  // bands meet where both have half their power
    quality[i] = 1.0 / (std::sqrt(ratio) - 1.0 / std::sqrt(ratio));
    gain[i] = wanted[i];
    const double g = std::tan(std::numbers::pi * hz[i] / rate_hz);
    a1_[i] = static_cast<float>(1.0 / (1.0 + g * (g + 1.0 / quality[i])));
    a2_[i] = static_cast<float>(g) * a1_[i];
    a3_[i] = static_cast<float>(g) * a2_[i];
  }
  // The skirts of the others add to each band: its gain is corrected until the sum is right there.
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t i = 0; i < count_; ++i) {
      std::complex<double> sum = 0;
      for (std::size_t j = 0; j < count_; ++j) sum += gain[j] * response(hz[i], hz[j], quality[j], rate_hz);
      gain[i] *= std::clamp(wanted[i] / std::max(1e-12, std::abs(sum)), 0.5, 2.0);
    }
  for (std::size_t i = 0; i < count_; ++i) gain_[i] = static_cast<float>(gain[i] / quality[i]);
}

void NoiseBank::add_to(Block& block, WhiteNoise& white, float from, float to) noexcept {
  float factor = from;
  const float step = (to - from) / kBlockFrames;
  for (float& x : block) {
    const float input = white.next();
    float sum = 0;
    // All lanes, so that the compiler takes several at once; those beyond count_ are zero.
    for (std::size_t i = 0; i < kMostNoisePoints; ++i) {
      const float v3 = input - s2_[i];
      const float band = a1_[i] * s1_[i] + a2_[i] * v3;
      const float low = s2_[i] + a2_[i] * s1_[i] + a3_[i] * v3;
      s1_[i] = 2.0F * band - s1_[i];
      s2_[i] = 2.0F * low - s2_[i];
      sum += gain_[i] * band;
    }
    x += factor * sum;
    factor += step;
  }
}

}  // namespace osteon::audio
