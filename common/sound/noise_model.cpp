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

std::vector<float> sine_window(int size) {
  std::vector<float> window(static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < window.size(); ++i)
    window[i] = static_cast<float>(std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / size));
  return window;
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
  const double bin_hz = rate_hz / params.window, top_hz = 0.5 * rate_hz;
  const int bins = params.window / 2;
  OSTEON_CHECK(params.window >= 32 && params.points >= 2 && params.points <= bins + 1);
  // So many points a bin apart, that the next ratio is at least a bin.
  std::vector<double> points{0.0};
  for (int left = params.points - 1; left > 0; --left) {
    const double last = points.back();
    const double ratio_step = last > 0 ? last * (std::pow(top_hz / last, 1.0 / left) - 1.0) : 0.0;
    points.push_back(left == 1 ? top_hz : last + std::max(bin_hz, ratio_step));
  }
  return points;
}

NoiseModel noise_model(std::span<const float> residual, double rate_hz, const NoiseParams& params) {
  NoiseModel model{
      .rate_hz = rate_hz, .window = params.window, .points_hz = noise_points_hz(rate_hz, params), .levels_db = {}};
  model.frames = residual.size() / model.hop() + 2;
  const std::size_t points = model.points_hz.size();
  RealFft fft(params.window);
  const std::vector<float> window = sine_window(params.window);
  // Power density of a bin: |X|^2 over the rate and the window's energy, twice for both signs of the frequency.
  const double scale = 2.0 / (rate_hz * window_energy(window));
  std::vector<float> shares(points * fft.bins());
  for (std::size_t p = 0; p < points; ++p)
    for (std::size_t k = 0; k < fft.bins(); ++k)
      shares[p * fft.bins() + k] =
          static_cast<float>(share(model.points_hz, p, static_cast<double>(k) * rate_hz / params.window));
  std::vector<float> frame(window.size());
  std::vector<std::complex<float>> bins(fft.bins());
  for (std::size_t m = 0; m < model.frames; ++m) {
    for (std::size_t i = 0; i < frame.size(); ++i) {
      const std::size_t at = m * model.hop() + i;  // of the signal, half a window later
      frame[i] =
          at >= model.hop() && at - model.hop() < residual.size() ? window[i] * residual[at - model.hop()] : 0.0F;
    }
    fft.forward(frame, bins);
    for (std::size_t p = 0; p < points; ++p) {
      double sum = 0, weight = 0;
      for (std::size_t k = 0; k < fft.bins(); ++k) {
        const double w = shares[p * fft.bins() + k];
        sum += w * std::norm(bins[k]);
        weight += w;
      }
      model.levels_db.push_back(static_cast<float>(power_db(scale * sum / weight)));
    }
  }
  return model;
}

std::vector<float> noise_sound(const NoiseModel& model, std::size_t samples, std::uint64_t seed) {
  std::vector<float> sound(samples, 0.0F);
  RealFft fft(model.window);
  const std::vector<float> window = sine_window(model.window);
  Random random(seed);
  std::vector<float> frame(window.size());
  std::vector<std::complex<float>> bins(fft.bins());
  const std::size_t points = model.points_hz.size();
  // A spectrum of magnitude A has the mean square A^2 / window^2 summed over both signs of the frequency.
  const double scale = 0.5 * model.rate_hz * model.window;
  for (std::size_t m = 0; m < model.frames; ++m) {
    const auto levels = std::span(model.levels_db).subspan(m * points, points);
    std::size_t right = 1;
    for (std::size_t k = 0; k < bins.size(); ++k) {
      const double hz = static_cast<double>(k) * model.rate_hz / model.window;
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
