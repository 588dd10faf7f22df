// How loud and how smooth a signal is. Levels in dB re full scale: a sine of amplitude 1 has -3.01 dB.
#pragma once
#include <span>
#include <vector>

namespace osteon::sound {

// Represents silence on a scale that has no zero.
inline constexpr double kSilence_db = -200.0;

[[nodiscard]] double rms_db(std::span<const float> samples);
[[nodiscard]] double peak(std::span<const float> samples);  // largest magnitude, 1 = full scale
// Largest difference between neighbouring samples. A sine of amplitude a has 2 a sin(pi f / rate).
[[nodiscard]] double largest_step(std::span<const float> samples);
[[nodiscard]] double power_db(double mean_square);         // 10 log10, not below kSilence_db
[[nodiscard]] double amplitude_of_db(double db) noexcept;  // the factor on samples that changes a level by so much

// Reference pressure p0 of sound levels in air, Pa.
inline constexpr double kReference_pa = 20e-6;
// Sound level L = 20 log10(p_rms / p0) of (8.9), dB. `level_db`: re full scale. `full_scale_pa`: the pressure of a
// sample of 1, from a calibrated recording, above 0.
[[nodiscard]] double sound_level_db(double level_db, double full_scale_pa);
// RMS level of each block of `block` samples (at least 1), dB re full scale. The last block may be shorter.
[[nodiscard]] std::vector<double> block_levels_db(std::span<const float> samples, std::size_t block);

}  // namespace osteon::sound
