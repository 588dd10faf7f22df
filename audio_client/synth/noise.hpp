// Seeded white noise and a band-pass filter with a variable frequency.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace osteon::audio {

inline constexpr double kWhiteVariance = 1.0 / 3.0;  // of numbers uniform over -1 to 1

// xorshift64*: the same seed makes the same noise on every machine.
class WhiteNoise {
 public:
  explicit WhiteNoise(std::uint64_t seed = 1) noexcept : state_(seed * 0x9E3779B97F4A7C15ULL | 1U) {}
  // Uniform over [-1, 1).
  float next() noexcept {
    state_ ^= state_ >> 12;
    state_ ^= state_ << 25;
    state_ ^= state_ >> 27;
    const auto bits = static_cast<std::int32_t>((state_ * 0x2545F4914F6CDD1DULL) >> 32);
    return static_cast<float>(bits) * (1.0F / 2147483648.0F);
  }

 private:
  std::uint64_t state_;
};

// Two-pole state variable filter in the trapezoidal form, stable while its coefficients change. The gain is 1 at the
// centre.
class BandPass {
 public:
  void set(double centre_hz, double rate_hz, double quality) noexcept {
    const double g = std::tan(std::numbers::pi * std::min(centre_hz, 0.45 * rate_hz) / rate_hz);
    damping_ = static_cast<float>(1.0 / quality);
    a1_ = static_cast<float>(1.0 / (1.0 + g * (g + 1.0 / quality)));
    a2_ = static_cast<float>(g) * a1_;
    a3_ = static_cast<float>(g) * a2_;
  }
  float next(float x) noexcept {
    const float v3 = x - s2_;
    const float band = a1_ * s1_ + a2_ * v3;
    const float low = s2_ + a2_ * s1_ + a3_ * v3;
    s1_ = 2.0F * band - s1_;
    s2_ = 2.0F * low - s2_;
    return damping_ * band;
  }

 private:
  float damping_ = 1, a1_ = 0, a2_ = 0, a3_ = 0, s1_ = 0, s2_ = 0;
};

}  // namespace osteon::audio
