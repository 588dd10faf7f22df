// What a classifier hears in a sound, for every 10 ms: the 50 ms around that moment.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace osteon::test {

inline constexpr double kFrame_s = 0.05, kFrameStep_s = 0.01;

enum class Hearing : std::uint8_t {
  spectrum,    // energies of third octaves, how far a line stands out in each, their change over 100 ms, and the flux
  equal_rms,   // the same of windows that all have the same level
  level_only,  // the level of the window, dB
};

// A row for each frame. Frame m has its middle at m * kFrameStep_s. Samples at 48 kHz. `faster`: all bands are so much
// higher, as if the sound were played slower.
[[nodiscard]] Eigen::MatrixXd features(std::span<const float> samples, Hearing hearing, double faster = 1.0);

// The samples with white noise, whose power is that of the sound in [from_s, to_s) less `snr_db`.
[[nodiscard]] std::vector<float> with_noise(std::span<const float> samples, double from_s, double to_s, double snr_db,
                                            std::uint64_t seed);

}  // namespace osteon::test
