// How much a resynthesised sound resembles the recording. All compare signals of one length without aligning gains.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace osteon::sound {

// Signal to noise: 10 log10(sum x^2 / sum (x - y)^2), dB; the difference counts as noise. At most 200 (equal signals).
// 0 if x is silent.
[[nodiscard]] double snr_db(std::span<const float> original, std::span<const float> other);

// Log-spectral distance (Gray 1976) of the long-term spectra: the RMS over the bins in 100 Hz ... 10 kHz of the
// difference of two Welch densities, dB (Hann windows of 4096 samples, half overlapped).
[[nodiscard]] double psd_lsd_db(std::span<const float> original, std::span<const float> other, double rate_hz);

struct MelBands {
  int bands = 64;
  double from_hz = 50.0, to_hz = 10000.0;
  int window = 2048, hop = 512;  // samples; frames lie within the signal
  double floor = 1e-10;          // energy below which a band counts as silent, |X|^2
  double range_db = 40.0;        // quieter frames than this below the loudest do not count
};
// Edges of triangular bands, bands + 2 of them in Hz, equally far apart on the mel scale 2595 log10(1 + f / 700)
// (Stevens 1937). Band b rises from edge b to edge b + 1 and falls to edge b + 2.
[[nodiscard]] std::vector<double> mel_edges_hz(const MelBands& bands);

// RMS over frames and mel bands of the difference of the bands' energies, dB. It sees time and colour, and no phase.
// 0 if the signal is shorter than a window. `to_hz` is at most half of the rate.
[[nodiscard]] double mel_lsd_db(std::span<const float> original, std::span<const float> other, double rate_hz,
                                const MelBands& bands = {});

// RMS difference of the levels of blocks of 10 ms, dB, over the blocks within 40 dB of the loudest. Whole blocks only.
[[nodiscard]] double envelope_error_db(std::span<const float> original, std::span<const float> other, double rate_hz);

}  // namespace osteon::sound
