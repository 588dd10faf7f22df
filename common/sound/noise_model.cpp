#include "common/sound/noise_model.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "common/core/check.hpp"
#include "common/sound/fourier.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/oscillator.hpp"
#include "common/sound/random.hpp"

namespace osteon::sound {
namespace {

// A frame with less of its window left than this has no level.
constexpr double kLeastLeft = 0.02;

// Its squares, half a window apart, sum to one, and it leaks less than a sine: the window of Vorbis (Xiph 2020).
std::vector<float> noise_window(int size) {
  std::vector<float> window(static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < window.size(); ++i) {
    const double sine = std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / size);
    window[i] = static_cast<float>(std::sin(0.5 * std::numbers::pi * sine * sine));
  }
  return window;
}

// First bin of the layer, and the one after its last.
struct BinRange {
  std::size_t begin = 0, end = 0;
};
BinRange bins_of(double rate_hz, const NoiseParams& params) {
  const double bin_hz = rate_hz / params.window;
  const std::size_t all = static_cast<std::size_t>(params.window) / 2 + 1;
  const auto at = [&](double hz) { return static_cast<std::size_t>(std::ceil(hz / bin_hz - 1e-9)); };
  return {at(params.from_hz), params.to_hz > 0.5 * rate_hz - 1e-6 ? all : std::min(all, at(params.to_hz))};
}

// Share of point i at a frequency: a tent from its neighbours on either side.
double share(const std::vector<double>& points_hz, std::size_t i, double hz) {
  if (i > 0 && hz < points_hz[i]) return std::max(0.0, (hz - points_hz[i - 1]) / (points_hz[i] - points_hz[i - 1]));
  if (i + 1 < points_hz.size() && hz > points_hz[i])
    return std::max(0.0, (points_hz[i + 1] - hz) / (points_hz[i + 1] - points_hz[i]));
  return 1.0;
}

}  // namespace

std::vector<double> noise_points_hz(double rate_hz, const NoiseParams& params) {
  const double bin_hz = rate_hz / params.window;
  OSTEON_CHECK(params.window >= 32 && params.from_hz >= 0 && params.to_hz <= 0.5 * rate_hz + 1e-6);
  OSTEON_CHECK(params.points >= 2 && params.to_hz - params.from_hz >= (params.points - 1) * bin_hz - 1e-6);
  std::vector<double> points{params.from_hz};
  for (int left = params.points - 1; left > 1; --left) {
    const double last = points.back();
    const double ratio_step = last > 0 ? last * (std::pow(params.to_hz / last, 1.0 / left) - 1.0) : 0.0;
    // At most so far that the others can still be a bin apart.
    points.push_back(std::min(last + std::max(bin_hz, ratio_step), params.to_hz - (left - 1) * bin_hz));
  }
  points.push_back(params.to_hz);
  return points;
}

std::size_t noise_frames(std::size_t samples, const NoiseParams& params) {
  return samples / (static_cast<std::size_t>(params.window) / 2) + 2;
}

NoiseModel noise_model(std::span<const float> residual, double rate_hz, const NoiseParams& params,
                       std::span<const float> weight) {
  OSTEON_CHECK(weight.empty() || weight.size() == residual.size());
  NoiseModel model{.rate_hz = rate_hz,
                   .params = params,
                   .points_hz = noise_points_hz(rate_hz, params),
                   .frames = noise_frames(residual.size(), params),
                   .levels_db = {}};
  const std::size_t points = model.points_hz.size();
  const BinRange range = bins_of(rate_hz, params);
  RealFft fft(params.window);
  const std::vector<float> window = noise_window(params.window);
  const double energy = window_energy(window);
  std::vector<float> shares(points * fft.bins());
  for (std::size_t p = 0; p < points; ++p)
    for (std::size_t k = range.begin; k < range.end; ++k)
      shares[p * fft.bins() + k] =
          static_cast<float>(share(model.points_hz, p, static_cast<double>(k) * rate_hz / params.window));
  std::vector<float> frame(window.size());
  std::vector<std::complex<float>> bins(fft.bins());
  for (std::size_t m = 0; m < model.frames; ++m) {
    double left = 0;  // of the window's energy
    for (std::size_t i = 0; i < frame.size(); ++i) {
      const std::size_t at = m * model.hop() + i;  // of the signal, half a window later
      const bool inside = at >= model.hop() && at - model.hop() < residual.size();
      frame[i] = inside ? window[i] * residual[at - model.hop()] : 0.0F;
      const double w = window[i] * (weight.empty() || !inside ? 1.0F : weight[at - model.hop()]);
      left += w * w;
    }
    fft.forward(frame, bins);
    // Power density of a bin: |X|^2 over the rate and the window's energy, twice for both signs of the frequency.
    const double scale = left > kLeastLeft * energy ? 2.0 / (rate_hz * left) : 0.0;
    for (std::size_t p = 0; p < points; ++p) {
      double sum = 0, all = 1e-12;
      for (std::size_t k = range.begin; k < range.end; ++k) {
        const double w = shares[p * fft.bins() + k];
        sum += w * std::norm(bins[k]);
        all += w;
      }
      model.levels_db.push_back(static_cast<float>(power_db(scale * sum / all)));
    }
  }
  return model;
}

std::vector<float> noise_sound(const NoiseModel& model, std::size_t samples, std::uint64_t seed) {
  std::vector<float> sound(samples, 0.0F);
  const BinRange range = bins_of(model.rate_hz, model.params);
  RealFft fft(model.params.window);
  const std::vector<float> window = noise_window(model.params.window);
  Random random(seed);
  std::vector<float> frame(window.size());
  std::vector<std::complex<float>> bins(fft.bins());
  const std::size_t points = model.points_hz.size();
  // A spectrum of magnitude A has the mean square A^2 / window^2 summed over both signs of the frequency.
  const double scale = 0.5 * model.rate_hz * model.params.window;
  for (std::size_t m = 0; m < model.frames; ++m) {
    const auto levels = std::span(model.levels_db).subspan(m * points, points);
    std::size_t right = 1;
    for (std::size_t k = range.begin; k < range.end; ++k) {
      const double hz = static_cast<double>(k) * model.rate_hz / model.params.window;
      while (right + 1 < points && model.points_hz[right] < hz) ++right;
      const double left_hz = model.points_hz[right - 1], right_hz = model.points_hz[right];
      const double part = std::clamp((hz - left_hz) / (right_hz - left_hz), 0.0, 1.0);
      const double db = levels[right - 1] + part * (levels[right] - levels[right - 1]);
      const auto magnitude = static_cast<float>(std::sqrt(scale * std::pow(10.0, db / 10.0)));
      const double turns = random.unit();
      // The first and the last bin are real.
      const bool real = k == 0 || k + 1 == bins.size();
      bins[k] = real ? std::complex<float>(turns < 0.5 ? magnitude : -magnitude, 0)
                     : std::complex<float>(magnitude * cosine(turns), magnitude * cosine(turns - 0.25));
    }
    fft.inverse(bins, frame);
    for (std::size_t i = 0; i < frame.size(); ++i) {
      const std::size_t at = m * model.hop() + i;
      if (at >= model.hop() && at - model.hop() < samples) sound[at - model.hop()] += window[i] * frame[i];
    }
  }
  return sound;
}

}  // namespace osteon::sound
