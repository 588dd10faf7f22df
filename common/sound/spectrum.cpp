#include "common/sound/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "common/core/check.hpp"
#include "common/sound/fourier.hpp"
#include "common/sound/levels.hpp"

namespace osteon::sound {

Spectrum power_spectrum(std::span<const float> samples, double rate_hz, int size) {
  OSTEON_CHECK(size >= 16 && (size & (size - 1)) == 0 && rate_hz > 0);
  const auto n = static_cast<std::size_t>(size);
  // A whole window on a part of it would weigh that part as the window's quiet beginning.
  const std::size_t length = std::clamp<std::size_t>(samples.size() / 2 * 2, 2, n);
  RealFft fft(size);
  const std::vector<float> window = hann_window(static_cast<int>(length));
  Spectrum result{rate_hz / size, std::vector<double>(fft.bins(), 0.0)};
  std::vector<float> frame(n, 0.0F);
  std::vector<std::complex<float>> bins(fft.bins());
  int frames = 0;
  for (std::size_t start = 0; frames == 0 || start + length <= samples.size(); start += length / 2, ++frames) {
    for (std::size_t i = 0; i < length; ++i)
      frame[i] = start + i < samples.size() ? window[i] * samples[start + i] : 0.0F;
    fft.forward(frame, bins);
    for (std::size_t k = 0; k < bins.size(); ++k) {
      const double re = bins[k].real(), im = bins[k].imag();
      result.power[k] += re * re + im * im;
    }
  }
  // Parseval: the two-sided sum of |X|^2 is size * sum (w x)^2. Inner bins represent both signs of the frequency.
  const double scale = 1.0 / (static_cast<double>(size) * window_energy(window) * frames);
  for (std::size_t k = 0; k <= n / 2; ++k) result.power[k] *= (k == 0 || k == n / 2) ? scale : 2.0 * scale;
  return result;
}

double density_db(const Spectrum& spectrum, std::size_t bin) { return power_db(spectrum.power[bin] / spectrum.bin_hz); }

double band_db(const Spectrum& spectrum, double from_hz, double to_hz) {
  double sum = 0;
  for (std::size_t k = 0; k < spectrum.power.size(); ++k) {
    const double hz = static_cast<double>(k) * spectrum.bin_hz;
    if (hz >= from_hz && hz < to_hz) sum += spectrum.power[k];
  }
  return power_db(sum);
}

double centroid_hz(const Spectrum& spectrum, double from_hz, double to_hz) {
  double sum = 0, moment = 0;
  for (std::size_t k = 0; k < spectrum.power.size(); ++k) {
    const double hz = static_cast<double>(k) * spectrum.bin_hz;
    if (hz < from_hz || hz >= to_hz) continue;
    sum += spectrum.power[k];
    moment += hz * spectrum.power[k];
  }
  return sum > 0 ? moment / sum : 0.0;
}

std::vector<Peak> strongest_peaks(const Spectrum& spectrum, int count, double apart_hz) {
  const auto& p = spectrum.power;
  std::vector<std::size_t> tops;
  for (std::size_t k = 2; k + 2 < p.size(); ++k) {
    if (p[k] > p[k - 1] && p[k] >= p[k + 1]) tops.push_back(k);
  }
  std::sort(tops.begin(), tops.end(), [&](std::size_t a, std::size_t b) { return p[a] > p[b]; });

  std::vector<Peak> peaks;
  for (const std::size_t k : tops) {
    if (static_cast<int>(peaks.size()) == count) break;
    // A parabola through the logarithms of the three highest bins.
    const double a = power_db(p[k - 1]), b = power_db(p[k]), c = power_db(p[k + 1]);
    const double bend = a - 2.0 * b + c;
    const double offset = bend < 0 ? 0.5 * (a - c) / bend : 0.0;
    const double hz = (static_cast<double>(k) + offset) * spectrum.bin_hz;
    const bool apart = std::all_of(peaks.begin(), peaks.end(),
                                   [&](const Peak& louder) { return std::abs(louder.hz - hz) >= apart_hz; });
    if (apart) peaks.push_back({hz, power_db(p[k - 2] + p[k - 1] + p[k] + p[k + 1] + p[k + 2])});
  }
  return peaks;
}

}  // namespace osteon::sound
