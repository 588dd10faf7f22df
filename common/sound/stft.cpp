#include "common/sound/stft.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"
#include "common/sound/fourier.hpp"

namespace osteon::sound {
namespace {

// Sample of the signal at which a frame begins. It is negative for the first frames.
std::ptrdiff_t frame_begin(const StftParams& params, std::size_t frame) {
  return static_cast<std::ptrdiff_t>(frame) * params.hop - params.window / 2;
}

std::size_t frame_count(std::size_t samples, const StftParams& params) {
  const auto hop = static_cast<std::size_t>(params.hop);
  return (samples + hop - 1) / hop + 1;
}

}  // namespace

void for_each_frame(std::span<const float> samples, const StftParams& params,
                    const std::function<void(std::size_t, std::span<const std::complex<float>>)>& take) {
  OSTEON_CHECK(params.window >= 2 && params.window % 2 == 0 && params.hop >= 1 && 2 * params.hop <= params.window);
  OSTEON_CHECK(params.size >= params.window);
  RealFft fft(params.size);
  const std::vector<float> window = hann_window(params.window);
  std::vector<float> frame(static_cast<std::size_t>(params.size), 0.0F);
  std::vector<std::complex<float>> bins(fft.bins());
  const auto count = static_cast<std::ptrdiff_t>(samples.size());
  for (std::size_t m = 0; m < frame_count(samples.size(), params); ++m) {
    const std::ptrdiff_t begin = frame_begin(params, m);
    for (std::ptrdiff_t i = 0; i < params.window; ++i) {
      const std::ptrdiff_t at = begin + i;
      frame[static_cast<std::size_t>(i)] =
          at >= 0 && at < count ? window[static_cast<std::size_t>(i)] * samples[static_cast<std::size_t>(at)] : 0.0F;
    }
    fft.forward(frame, bins);
    take(m, bins);
  }
}

double power_scale(const StftParams& params) {
  // Parseval: the sum of |X|^2 over both signs of the frequency is size * sum (w x)^2.
  return 1.0 / (static_cast<double>(params.size) * window_energy(hann_window(params.window)));
}

double band_energy(std::span<const std::complex<float>> bins, double rate_hz, double from_hz, double to_hz) {
  const double bin_hz = 0.5 * rate_hz / static_cast<double>(bins.size() - 1);
  const auto bin_at = [&](double hz) {
    return static_cast<std::size_t>(std::clamp(std::ceil(hz / bin_hz), 0.0, static_cast<double>(bins.size())));
  };
  double sum = 0;
  for (std::size_t k = bin_at(from_hz); k < bin_at(to_hz); ++k)
    sum += (k == 0 || k + 1 == bins.size() ? 1.0 : 2.0) * std::norm(bins[k]);
  return sum;
}

Stft stft(std::span<const float> samples, double rate_hz, const StftParams& params) {
  OSTEON_CHECK(rate_hz > 0);
  Stft result{.rate_hz = rate_hz, .params = params, .samples = samples.size(), .values = {}};
  result.frames = frame_count(samples.size(), params);
  result.values.reserve(result.frames * result.bins());
  for_each_frame(samples, params, [&](std::size_t, std::span<const std::complex<float>> bins) {
    result.values.insert(result.values.end(), bins.begin(), bins.end());
  });
  return result;
}

std::vector<float> inverse_stft(const Stft& transform) {
  RealFft fft(transform.params.size);
  const std::vector<float> window = hann_window(transform.params.window);
  std::vector<float> frame(static_cast<std::size_t>(transform.params.size));
  std::vector<float> signal(transform.samples, 0.0F), weight(transform.samples, 0.0F);
  const auto count = static_cast<std::ptrdiff_t>(transform.samples);
  for (std::size_t m = 0; m < transform.frames; ++m) {
    fft.inverse(transform.frame(m), frame);
    const std::ptrdiff_t begin = frame_begin(transform.params, m);
    const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, -begin);
    const std::ptrdiff_t last = std::min<std::ptrdiff_t>(transform.params.window, count - begin);
    for (std::ptrdiff_t i = first; i < last; ++i) {
      const float w = window[static_cast<std::size_t>(i)];
      const auto at = static_cast<std::size_t>(begin + i);
      signal[at] += w * frame[static_cast<std::size_t>(i)];
      weight[at] += w * w;
    }
  }
  // With hops of half a window or less, each sample has a weight of at least 0.5.
  for (std::size_t i = 0; i < signal.size(); ++i) signal[i] /= weight[i];
  return signal;
}

Spectrogram spectrogram(std::span<const float> samples, double rate_hz, int window, std::size_t most_columns) {
  OSTEON_CHECK(window >= 8 && window % 8 == 0 && most_columns >= 1 && rate_hz > 0);
  const StftParams params{.window = window, .hop = window / 4, .size = window};
  const std::size_t frames = frame_count(samples.size(), params);
  const std::size_t together = (frames + most_columns - 1) / most_columns;
  Spectrogram result{.column_s = static_cast<double>(together) * params.hop / rate_hz,
                     .bin_hz = rate_hz / window,
                     .columns = (frames + together - 1) / together,
                     .bins = static_cast<std::size_t>(window) / 2 + 1,
                     .power = {}};
  result.power.resize(result.columns * result.bins, 0.0F);
  const double scale = power_scale(params);
  for_each_frame(samples, params, [&](std::size_t m, std::span<const std::complex<float>> bins) {
    const std::size_t column = m / together;
    const std::size_t in_column = std::min(frames - column * together, together);
    for (std::size_t k = 0; k < bins.size(); ++k) {
      const double both_signs = k == 0 || k + 1 == bins.size() ? 1.0 : 2.0;
      result.power[column * result.bins + k] +=
          static_cast<float>(both_signs * scale * std::norm(bins[k]) / static_cast<double>(in_column));
    }
  });
  return result;
}

}  // namespace osteon::sound
