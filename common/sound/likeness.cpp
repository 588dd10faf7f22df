#include "common/sound/likeness.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "common/core/check.hpp"
#include "common/sound/fourier.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/spectrum.hpp"

namespace osteon::sound {
namespace {

constexpr double kEqual_db = 200.0;
constexpr double kPsdFrom_hz = 100.0, kPsdTo_hz = 10000.0;
constexpr int kPsdWindow = 4096;
constexpr double kBlock_s = 0.01, kBlockRange_db = 40.0;

double mel_of(double hz) { return 2595.0 * std::log10(1.0 + hz / 700.0); }
double hz_of(double mel) { return 700.0 * (std::pow(10.0, mel / 2595.0) - 1.0); }

// Energy in each mel band of each frame, and of each frame as a whole.
struct MelEnergies {
  std::vector<double> frames;
  std::vector<double> bands;  // a row for each frame
};

MelEnergies mel_energies(std::span<const float> samples, double rate_hz, const MelBands& mel) {
  const auto window_size = static_cast<std::size_t>(mel.window), hop = static_cast<std::size_t>(mel.hop);
  const std::vector<double> edges = mel_edges_hz(mel);
  const std::vector<float> window = hann_window(mel.window);
  RealFft fft(mel.window);
  std::vector<float> frame(window_size);
  std::vector<std::complex<float>> bins(fft.bins());
  MelEnergies result;
  for (std::size_t start = 0; start + window_size <= samples.size(); start += hop) {
    for (std::size_t i = 0; i < window_size; ++i) frame[i] = window[i] * samples[start + i];
    fft.forward(frame, bins);
    double whole = 0;
    for (const std::complex<float>& x : bins) whole += std::norm(x);
    result.frames.push_back(whole);
    for (int b = 0; b < mel.bands; ++b) {
      const auto at = static_cast<std::size_t>(b);
      const double low = edges[at], middle = edges[at + 1], high = edges[at + 2];
      double sum = 0;
      for (auto k = static_cast<std::size_t>(low * mel.window / rate_hz); k < bins.size(); ++k) {
        const double hz = static_cast<double>(k) * rate_hz / mel.window;
        if (hz >= high) break;
        const double weight = std::min((hz - low) / (middle - low), (high - hz) / (high - middle));
        if (weight > 0) sum += weight * std::norm(bins[k]);
      }
      result.bands.push_back(sum);
    }
  }
  return result;
}

double db_between(double a, double b, double floor) {
  return 10.0 * std::log10(std::max(a, floor) / std::max(b, floor));
}

double rms_of(double squares, std::size_t count) {
  return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0.0;
}

}  // namespace

double snr_db(std::span<const float> original, std::span<const float> other) {
  OSTEON_CHECK(original.size() == other.size());
  double signal = 0, noise = 0;
  for (std::size_t i = 0; i < original.size(); ++i) {
    const double x = original[i], d = x - other[i];
    signal += x * x;
    noise += d * d;
  }
  if (signal == 0) return 0.0;
  return noise > 0 ? std::min(kEqual_db, 10.0 * std::log10(signal / noise)) : kEqual_db;
}

double psd_lsd_db(std::span<const float> original, std::span<const float> other, double rate_hz) {
  OSTEON_CHECK(original.size() == other.size());
  const Spectrum x = power_spectrum(original, rate_hz, kPsdWindow), y = power_spectrum(other, rate_hz, kPsdWindow);
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < x.power.size(); ++k) {
    const double hz = static_cast<double>(k) * x.bin_hz;
    if (hz < kPsdFrom_hz || hz > kPsdTo_hz) continue;
    const double difference = density_db(x, k) - density_db(y, k);
    squares += difference * difference;
    ++count;
  }
  return rms_of(squares, count);
}

std::vector<double> mel_edges_hz(const MelBands& bands) {
  OSTEON_CHECK(bands.bands >= 1 && bands.from_hz >= 0 && bands.to_hz > bands.from_hz);
  const double from = mel_of(bands.from_hz), step = (mel_of(bands.to_hz) - from) / (bands.bands + 1);
  std::vector<double> edges;
  for (int i = 0; i < bands.bands + 2; ++i) edges.push_back(hz_of(from + i * step));
  return edges;
}

double mel_lsd_db(std::span<const float> original, std::span<const float> other, double rate_hz,
                  const MelBands& bands) {
  OSTEON_CHECK(original.size() == other.size() && bands.to_hz <= 0.5 * rate_hz && bands.hop >= 1);
  const MelEnergies x = mel_energies(original, rate_hz, bands), y = mel_energies(other, rate_hz, bands);
  if (x.frames.empty()) return 0.0;
  const double least = *std::ranges::max_element(x.frames) * std::pow(10.0, -bands.range_db / 10.0);
  const auto row = static_cast<std::size_t>(bands.bands);
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t m = 0; m < x.frames.size(); ++m) {
    if (x.frames[m] < least) continue;
    for (std::size_t b = m * row; b < (m + 1) * row; ++b) {
      const double difference = db_between(x.bands[b], y.bands[b], bands.floor);
      squares += difference * difference;
    }
    count += row;
  }
  return rms_of(squares, count);
}

double envelope_error_db(std::span<const float> original, std::span<const float> other, double rate_hz) {
  OSTEON_CHECK(original.size() == other.size() && rate_hz > 0);
  const auto block = static_cast<std::size_t>(std::llround(kBlock_s * rate_hz));
  const std::size_t whole = original.size() / block * block;
  if (whole == 0) return 0.0;
  const std::vector<double> x = block_levels_db(original.first(whole), block);
  const std::vector<double> y = block_levels_db(other.first(whole), block);
  const double least = *std::ranges::max_element(x) - kBlockRange_db;
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] < least) continue;
    squares += (x[i] - y[i]) * (x[i] - y[i]);
    ++count;
  }
  return rms_of(squares, count);
}

}  // namespace osteon::sound
