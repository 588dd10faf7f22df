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

}  // namespace

Stft stft(std::span<const float> samples, double rate_hz, const StftParams& params) {
  OSTEON_CHECK(params.window >= 2 && params.window % 2 == 0 && params.hop >= 1 && 2 * params.hop <= params.window);
  OSTEON_CHECK(params.size >= params.window && rate_hz > 0);
  Stft result{.rate_hz = rate_hz, .params = params, .samples = samples.size(), .values = {}};
  const auto hop = static_cast<std::size_t>(params.hop);
  result.frames = (samples.size() + hop - 1) / hop + 1;
  result.values.resize(result.frames * result.bins());

  RealFft fft(params.size);
  const std::vector<float> window = hann_window(params.window);
  // Parseval: the sum of |X|^2 over both signs of the frequency is size * sum (w x)^2.
  result.power_scale = 1.0 / (static_cast<double>(params.size) * window_energy(window));
  std::vector<float> frame(static_cast<std::size_t>(params.size), 0.0F);
  const auto count = static_cast<std::ptrdiff_t>(samples.size());
  for (std::size_t m = 0; m < result.frames; ++m) {
    const std::ptrdiff_t begin = frame_begin(params, m);
    for (std::ptrdiff_t i = 0; i < params.window; ++i) {
      const std::ptrdiff_t at = begin + i;
      frame[static_cast<std::size_t>(i)] =
          at >= 0 && at < count ? window[static_cast<std::size_t>(i)] * samples[static_cast<std::size_t>(at)] : 0.0F;
    }
    fft.forward(frame, result.frame(m));
  }
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

double band_power(const Stft& transform, std::size_t frame, double from_hz, double to_hz) {
  const auto bin_at = [&](double hz) {
    return static_cast<std::size_t>(
        std::clamp(std::ceil(hz / transform.bin_hz()), 0.0, static_cast<double>(transform.bins())));
  };
  const std::span<const std::complex<float>> bins = transform.frame(frame);
  double sum = 0;
  for (std::size_t k = bin_at(from_hz); k < bin_at(to_hz); ++k)
    sum += (k == 0 || k + 1 == bins.size() ? 1.0 : 2.0) * std::norm(bins[k]);
  return sum * transform.power_scale;
}

}  // namespace osteon::sound
