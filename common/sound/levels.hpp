// How loud and how smooth a signal is. Levels in dB re full scale: a sine of amplitude 1 has -3.01 dB.
#pragma once
#include <span>

namespace osteon::sound {

// Represents silence on a scale that has no zero.
inline constexpr double kSilence_db = -200.0;

[[nodiscard]] double rms_db(std::span<const float> samples);
[[nodiscard]] double peak(std::span<const float> samples);  // largest magnitude, 1 = full scale
// Largest difference between neighbouring samples. A sine of amplitude a has 2 a sin(pi f / rate).
[[nodiscard]] double largest_step(std::span<const float> samples);
[[nodiscard]] double power_db(double mean_square);  // 10 log10, not below kSilence_db

}  // namespace osteon::sound
