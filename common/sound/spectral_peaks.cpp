#include "common/sound/spectral_peaks.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/check.hpp"

namespace osteon::sound {
namespace {

using std::numbers::pi;

constexpr int kLobeSteps = 64;
// Beyond so many side lobes, a line is more than 75 dB below its top.
constexpr double kLobeReach = 10.0;  // in bins of a transform without padding

// Side lobes are masked as far as they are louder than a 16-bit recording's noise, 60 bins without padding.
constexpr double kMaskReach = 60.0;
// They are louder by up to 3 dB if the amplitude changes within the frame.
constexpr double kMaskMargin = 2.0;  // in power

// Transform of a Hann window of `window` samples about its middle, at x bins of a transform of that size, for a window
// of many samples: window / 2 sinc(x) / (1 - x^2).
double hann_lobe(double x, int window) {
  const double half = 0.5 * window;
  if (std::abs(x) < 1e-6) return half;
  if (std::abs(std::abs(x) - 1.0) < 1e-6) return 0.5 * half;
  return half * std::sin(pi * x) / (pi * x) / (1.0 - x * x);
}

}  // namespace

PeakFinder::PeakFinder(int window, double rate_hz, const PeakParams& params)
    : window_(window),
      rate_hz_(rate_hz),
      params_(params),
      fft_(params.size),
      hann_(hann_window(window)),
      time_(static_cast<std::size_t>(params.size), 0.0F),
      bins_(fft_.bins()),
      power_(fft_.bins()) {
  OSTEON_CHECK(window >= 32 && window <= params.size && rate_hz > 0 && params.most >= 1 && params.refinements >= 0);
  const double padding = static_cast<double>(params.size) / window;
  reach_ = static_cast<int>(kLobeReach * padding);
  for (int i = 0; i <= (reach_ + 2) * kLobeSteps; ++i)
    lobe_.push_back(static_cast<float>(hann_lobe(i / (kLobeSteps * padding), window)));
  for (int bin = 0; bin <= static_cast<int>(kMaskReach * padding); ++bin) {
    const double x = bin / padding;  // the main lobe goes to 2
    side_.push_back(x < 2.0 ? 0.0F : static_cast<float>(kMaskMargin * std::pow(1.0 / (pi * x * (x * x - 1.0)), 2.0)));
  }
}

double PeakFinder::window_at(double bins) const {
  const double at = std::abs(bins) * kLobeSteps;
  const auto below = static_cast<std::size_t>(at);
  if (below + 1 >= lobe_.size()) return 0.0;
  const double part = at - static_cast<double>(below);
  return lobe_[below] + part * (lobe_[below + 1] - lobe_[below]);
}

// The middle of the frame comes first, so that the phase does not turn from bin to bin (zero-phase windowing).
void PeakFinder::transform(std::span<const float> frame) {
  const auto half = static_cast<std::size_t>(window_) / 2, size = static_cast<std::size_t>(params_.size);
  std::fill(time_.begin(), time_.end(), 0.0F);
  for (std::size_t i = 0; i < half; ++i) {
    time_[i] = hann_[half + i] * frame[half + i];
    time_[size - half + i] = hann_[i] * frame[i];
  }
  fft_.forward(time_, bins_);
}

// The line whose top is at or near `bin`.
PeakFinder::Line PeakFinder::estimated(int bin) const {
  const auto k = static_cast<std::size_t>(bin);
  const auto db = [&](std::size_t at) { return 10.0 * std::log10(std::norm(bins_[at]) + 1e-30F); };
  const double alpha = db(k - 1), beta = db(k), gamma = db(k + 1);
  const double bend = alpha - 2.0 * beta + gamma;
  const double offset = bend < 0 ? std::clamp(0.5 * (alpha - gamma) / bend, -0.75, 0.75) : 0.0;
  const std::complex<double> value(bins_[k].real(), bins_[k].imag());
  return {.bin = bin + offset, .half = value / window_at(offset)};
}

std::vector<PeakFinder::Line> PeakFinder::pick() {
  // Twice the amplitude's half under the window, squared.
  const double least = std::pow(0.25 * window_ * std::pow(10.0, params_.threshold_db / 20.0), 2.0);
  std::vector<int> tops;
  for (std::size_t k = 2; k + 2 < power_.size(); ++k)
    if (power_[k] > least && power_[k] > power_[k - 1] && power_[k] >= power_[k + 1])
      tops.push_back(static_cast<int>(k));
  const auto louder = [&](int a, int b) {
    const float pa = power_[static_cast<std::size_t>(a)], pb = power_[static_cast<std::size_t>(b)];
    return pa != pb ? pa > pb : a < b;
  };
  std::ranges::sort(tops, louder);
  mask_.assign(power_.size(), 0.0F);
  std::vector<Line> lines;
  for (const int top : tops) {
    if (lines.size() == static_cast<std::size_t>(params_.most)) break;
    const float power = power_[static_cast<std::size_t>(top)];
    if (power < mask_[static_cast<std::size_t>(top)]) continue;
    lines.push_back(estimated(top));
    const int reach = static_cast<int>(side_.size()) - 1;
    const int last = std::min(static_cast<int>(mask_.size()) - 1, top + reach);
    for (int k = std::max(0, top - reach); k <= last; ++k) {
      float& mask = mask_[static_cast<std::size_t>(k)];
      mask = std::max(mask, power * side_[static_cast<std::size_t>(std::abs(k - top))]);
    }
  }
  return lines;
}

// Adds the line's spectrum to the bins round it, or takes it away. Near 0 Hz the line's mirror image is there too.
void PeakFinder::add(const Line& line, double sign) {
  const int middle = static_cast<int>(std::lround(line.bin));
  const int first = std::max(0, middle - reach_), last = std::min(static_cast<int>(bins_.size()) - 1, middle + reach_);
  for (int k = first; k <= last; ++k) {
    std::complex<double> value = line.half * window_at(k - line.bin);
    if (k + line.bin < reach_) value += std::conj(line.half) * window_at(k + line.bin);
    bins_[static_cast<std::size_t>(k)] += std::complex<float>(sign * value);
  }
}

void PeakFinder::refine(std::vector<Line>& lines) {
  for (const Line& line : lines) add(line, -1.0);
  for (int round = 0; round < params_.refinements; ++round)
    for (Line& line : lines) {
      add(line, 1.0);
      const int last = static_cast<int>(bins_.size()) - 3;
      const int near = std::clamp(static_cast<int>(std::lround(line.bin)), 2, last);
      int top = near;
      for (int k = std::max(2, near - 1); k <= std::min(last, near + 1); ++k)
        if (std::norm(bins_[static_cast<std::size_t>(k)]) > std::norm(bins_[static_cast<std::size_t>(top)])) top = k;
      line = estimated(top);
      add(line, -1.0);
    }
}

std::vector<Sinusoid> PeakFinder::find(std::span<const float> frame) {
  OSTEON_CHECK(frame.size() == static_cast<std::size_t>(window_));
  transform(frame);
  for (std::size_t k = 0; k < bins_.size(); ++k) power_[k] = std::norm(bins_[k]);
  std::vector<Line> lines = pick();
  if (params_.refinements > 0) refine(lines);
  std::vector<Sinusoid> peaks;
  peaks.reserve(lines.size());
  for (const Line& line : lines)
    peaks.push_back({.hz = line.bin * rate_hz_ / params_.size,
                     .amplitude = 2.0 * std::abs(line.half),
                     .phase = std::arg(line.half)});
  std::ranges::sort(peaks, {}, &Sinusoid::hz);
  return peaks;
}

}  // namespace osteon::sound
