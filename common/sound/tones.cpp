#include "common/sound/tones.hpp"

#include <cmath>
#include <numbers>

#include "common/core/check.hpp"
#include "common/sound/levels.hpp"

namespace osteon::sound {
namespace {

// Squared amplitude of a sine at `hz` under a Hann window. It uses rotating phasors instead of Goertzel's real
// recurrence, which loses digits at low frequencies.
double squared_amplitude(std::span<const float> samples, double rate_hz, double hz) {
  const auto n = static_cast<double>(samples.size());
  const double turn = 2.0 * std::numbers::pi * hz / rate_hz;
  const double window_turn = 2.0 * std::numbers::pi / n;
  const double c = std::cos(turn), s = std::sin(turn), wc = std::cos(window_turn), ws = std::sin(window_turn);
  double re = 1, im = 0, w_re = 1, w_im = 0, sum_re = 0, sum_im = 0;
  for (const float x : samples) {
    const double v = x * (0.5 - 0.5 * w_re);
    sum_re += v * re;
    sum_im -= v * im;
    const double next_re = re * c - im * s;
    im = re * s + im * c;
    re = next_re;
    const double next_w = w_re * wc - w_im * ws;
    w_im = w_re * ws + w_im * wc;
    w_re = next_w;
  }
  // The window halves the mean, and a real sine has half its amplitude at each sign of the frequency.
  const double scale = 4.0 / n;
  return scale * scale * (sum_re * sum_re + sum_im * sum_im);
}

}  // namespace

double tone_db(std::span<const float> samples, double rate_hz, double hz) {
  return samples.empty() ? kSilence_db : power_db(squared_amplitude(samples, rate_hz, hz));
}

Tone find_tone(std::span<const float> samples, double rate_hz, double low_hz, double high_hz) {
  OSTEON_CHECK(!samples.empty() && low_hz <= high_hz);
  // The main lobe is 4 / duration wide, so steps of a quarter of that miss no peak.
  const double step = rate_hz / static_cast<double>(samples.size());
  double best_hz = low_hz, best = -1;
  for (int i = 0; low_hz + i * step <= high_hz; ++i) {
    const double hz = low_hz + i * step;
    const double power = squared_amplitude(samples, rate_hz, hz);
    if (power > best) best = power, best_hz = hz;
  }
  // Golden-section search inside the lobe, which has one maximum.
  constexpr double kGolden = 0.6180339887498949;
  double a = best_hz - step, b = best_hz + step;
  double c = b - kGolden * (b - a), d = a + kGolden * (b - a);
  double at_c = squared_amplitude(samples, rate_hz, c), at_d = squared_amplitude(samples, rate_hz, d);
  for (int i = 0; i < 24; ++i) {
    if (at_c > at_d) {
      b = d, d = c, at_d = at_c;
      c = b - kGolden * (b - a);
      at_c = squared_amplitude(samples, rate_hz, c);
    } else {
      a = c, c = d, at_c = at_d;
      d = a + kGolden * (b - a);
      at_d = squared_amplitude(samples, rate_hz, d);
    }
  }
  const double hz = 0.5 * (a + b);
  return {hz, tone_db(samples, rate_hz, hz)};
}

std::vector<double> track_tone(std::span<const float> samples, double rate_hz, double start_hz,
                               const TrackParams& params) {
  OSTEON_CHECK(params.window > 0 && params.hop > 0);
  std::vector<double> track;
  double hz = start_hz;
  const auto window = static_cast<std::size_t>(params.window);
  for (std::size_t at = 0; at + window <= samples.size(); at += static_cast<std::size_t>(params.hop)) {
    const Tone tone =
        find_tone(samples.subspan(at, window), rate_hz, hz * (1.0 - params.reach), hz * (1.0 + params.reach));
    if (tone.level_db > params.quiet_db) hz = tone.hz;
    track.push_back(hz);
  }
  return track;
}

}  // namespace osteon::sound
