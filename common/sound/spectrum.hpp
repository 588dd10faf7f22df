// Average power spectrum of a signal (Welch 1967: Hann windows, half overlapped; Figure 8.8), and measurements on it.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace osteon::sound {

// One-sided: power[k] belongs to k * bin_hz, for k = 0 ... size / 2. The sum is the mean square of the signal. A sine
// of amplitude a has a^2 / 3 in its own bin and a^2 / 12 in each neighbour, if its frequency is that of a bin and it
// lasts for a window.
struct Spectrum {
  double bin_hz = 0;
  std::vector<double> power;
};

// `size`: samples in a window, a power of two. A shorter signal has one window of its own length, before silence: its
// power is right, but its lines are wider.
[[nodiscard]] Spectrum power_spectrum(std::span<const float> samples, double rate_hz, int size = 4096);

// Power spectral density of a bin, dB re full scale squared per hertz.
[[nodiscard]] double density_db(const Spectrum& spectrum, std::size_t bin);

// Level of all power in [from_hz, to_hz).
[[nodiscard]] double band_db(const Spectrum& spectrum, double from_hz, double to_hz);

// Power-weighted mean frequency, a measure of brightness. 0 for silence.
[[nodiscard]] double centroid_hz(const Spectrum& spectrum, double from_hz, double to_hz);

struct Peak {
  double hz = 0;
  double level_db = 0;  // of the bins in the window's main lobe
};
// The strongest local maxima, loudest first. Each is at least `apart_hz` from any louder one.
[[nodiscard]] std::vector<Peak> strongest_peaks(const Spectrum& spectrum, int count, double apart_hz);

}  // namespace osteon::sound
