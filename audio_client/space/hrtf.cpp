#include "audio_client/space/hrtf.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include "common/sound/fourier.hpp"

namespace osteon::audio {
namespace {

constexpr int kTransform = 2 * Hrtf::kMostTaps;
constexpr float kDeepest = 1e-2F;       // a notch below the loudest line, of which minimum phase would make a long tone
constexpr double kDelayBand_hz = 3000;  // where ears compare times; beyond, the far ear hears round both sides
constexpr int kFade = 16;               // taps in which a filter that is cut short fades out
constexpr std::size_t kNeighbours = 3;
constexpr double kAsNear = 1.001;  // files have directions as single floats

// An impulse response as a delay and a filter of minimum phase.
struct Separated {
  std::vector<float> filter;
  double delay_frames = 0;
};

class Separator {
 public:
  explicit Separator(double rate_hz)
      : fft_(kTransform),
        response_(fft_.bins()),
        minimum_(fft_.bins()),
        equaliser_(fft_.bins(), 1.0F),
        time_(kTransform),
        band_(fft_.bins()) {
    for (std::size_t k = 0; k < band_.size(); ++k)
      band_[k] =
          static_cast<float>(std::exp(-std::pow(static_cast<double>(k) * rate_hz / kTransform / kDelayBand_hz, 4)));
  }

  // Takes out of later responses what all of these have in common: the canal and the outer ear, and the loudspeaker of
  // the measurement. Headphones bring the first two themselves (Møller 1992).
  void equalise(std::span<const HeadResponse> measured) {
    std::vector<double> power(response_.size(), 0.0);
    for (const HeadResponse& one : measured)
      for (const std::span<const float> ear : {std::span(one.left), std::span(one.right)}) {
        transform(ear);
        for (std::size_t k = 0; k < power.size(); ++k) power[k] += std::norm(response_[k]);
      }
    const double most = *std::ranges::max_element(power);
    if (most <= 0) return;
    for (std::size_t k = 0; k < power.size(); ++k)
      minimum_[k] = static_cast<float>(-0.5 * std::log(std::max(power[k] / most, double{kDeepest} * kDeepest)));
    to_minimum_phase();
    equaliser_ = minimum_;
  }

  // The delay is where the response and its own minimum-phase form are most alike.
  Separated separated(std::span<const float> response) {
    transform(response);
    float loudest = 0;
    for (const std::complex<float> line : response_) loudest = std::max(loudest, std::abs(line));
    Separated made;
    if (loudest == 0) {
      made.filter.assign(kEarTaps, 0.0F);
      return made;
    }
    for (std::size_t k = 0; k < response_.size(); ++k)
      minimum_[k] = std::log(std::max(std::abs(response_[k]), kDeepest * loudest));
    to_minimum_phase();
    made.delay_frames = delay();
    for (std::size_t k = 0; k < minimum_.size(); ++k) minimum_[k] *= equaliser_[k];
    fft_.inverse(minimum_, time_);
    made.filter.assign(time_.begin(), time_.begin() + kEarTaps);
    for (int i = 0; i < kFade; ++i)
      made.filter[static_cast<std::size_t>(kEarTaps - kFade + i)] *=
          static_cast<float>(0.5 + 0.5 * std::cos(std::numbers::pi * (i + 1) / (kFade + 1)));
    return made;
  }

 private:
  void transform(std::span<const float> response) {
    std::ranges::fill(time_, 0.0F);
    std::ranges::copy(response, time_.begin());
    fft_.forward(time_, response_);
  }

  // minimum_, logarithms of magnitudes, becomes a spectrum of them with minimum phase, by the folded cepstrum
  // (Oppenheim 1989).
  void to_minimum_phase() {
    fft_.inverse(minimum_, time_);
    for (std::size_t n = 1; n < time_.size() / 2; ++n) time_[n] *= 2.0F;
    std::fill(time_.begin() + kTransform / 2 + 1, time_.end(), 0.0F);
    fft_.forward(time_, minimum_);
    for (std::complex<float>& line : minimum_) line = std::exp(line);
  }

  // The maximum of the correlation below kDelayBand_hz, on the parabola through three frames.
  double delay() {
    for (std::size_t k = 0; k < response_.size(); ++k) response_[k] *= std::conj(minimum_[k]) * band_[k];
    fft_.inverse(response_, time_);
    const auto peak = std::max_element(time_.begin(), time_.begin() + kTransform / 2) - time_.begin();
    const auto at = [&](std::ptrdiff_t n) {
      return static_cast<double>(time_[static_cast<std::size_t>(n + kTransform) % kTransform]);
    };
    const double before = at(peak - 1), top = at(peak), after = at(peak + 1);
    const double curve = before - 2 * top + after;
    return static_cast<double>(peak) + (curve < 0 ? 0.5 * (before - after) / curve : 0.0);
  }

  sound::RealFft fft_;
  std::vector<std::complex<float>> response_, minimum_, equaliser_;
  std::vector<float> time_, band_;
};

struct Measurement {
  Vec3 towards;
  Separated left, right;
};

void add(EarResponse& sum, const Separated& part, double weight, double rate_hz) {
  for (std::size_t i = 0; i < sum.filter.size(); ++i) sum.filter[i] += static_cast<float>(weight) * part.filter[i];
  sum.delay_s += weight * part.delay_frames / rate_hz;
}

void add(EarResponse& sum, const EarResponse& part, double weight) noexcept {
  const auto share = static_cast<float>(weight);
  for (std::size_t i = 0; i < sum.filter.size(); ++i) sum.filter[i] += share * part.filter[i];
  sum.delay_s += weight * part.delay_s;
}

// The mean of the nearest measurements, with weights of the inverse fourth power of the distance: of a measured
// direction, that measurement. Those that are as near as the third count too, so that a symmetric head stays symmetric.
EarPair interpolated(const std::vector<Measurement>& measured, const Vec3& direction, double rate_hz) {
  std::vector<double> apart(measured.size());
  for (std::size_t m = 0; m < measured.size(); ++m) apart[m] = (measured[m].towards - direction).squaredNorm();
  std::vector<double> sorted = apart;
  std::nth_element(sorted.begin(), sorted.begin() + kNeighbours - 1, sorted.end());
  const double reach = kAsNear * sorted[kNeighbours - 1];
  double all = 0;
  for (double& one : apart) {
    one = one <= reach ? 1.0 / (one * one + 1e-16) : 0.0;
    all += one;
  }
  EarPair ears;
  for (std::size_t m = 0; m < measured.size(); ++m) {
    if (apart[m] == 0) continue;
    add(ears.left, measured[m].left, apart[m] / all, rate_hz);
    add(ears.right, measured[m].right, apart[m] / all, rate_hz);
  }
  return ears;
}

// Mean of the power gains from 400 to 6000 Hz, where a drilling sounds (8.5.4). There an ear is louder by many dB than
// over all frequencies, so a head that kept the power of white noise would reach full scale.
double drilling_power(const EarFilter& filter, double rate_hz) {
  constexpr int kFrom_hz = 400, kTo_hz = 6000, kStep_hz = 100;
  double sum = 0;
  int count = 0;
  for (int hz = kFrom_hz; hz <= kTo_hz; hz += kStep_hz, ++count) {
    std::complex<double> response = 0;
    for (std::size_t n = 0; n < filter.size(); ++n)
      response += static_cast<double>(filter[n]) *
                  std::polar(1.0, -2 * std::numbers::pi * hz * static_cast<double>(n) / rate_hz);
    sum += std::norm(response);
  }
  return sum / count;
}

bool usable(std::span<const float> response) {
  return !response.empty() && response.size() <= Hrtf::kMostTaps &&
         std::ranges::all_of(response, [](float x) { return std::isfinite(x); });
}

}  // namespace

Result<Hrtf> Hrtf::make(std::span<const HeadResponse> measured, double rate_hz) {
  if (measured.size() <= kNeighbours)
    return failure(ErrorCode::invalid_input, "it has " + std::to_string(measured.size()) + " directions, and needs 4");
  std::vector<Measurement> parts;
  Separator separator(rate_hz);
  for (const HeadResponse& one : measured) {
    if (!one.towards.allFinite() || one.towards.norm() < 1e-9)
      return failure(ErrorCode::invalid_input, "a direction is no direction");
    if (!usable(one.left) || !usable(one.right))
      return failure(ErrorCode::invalid_input,
                     "a response is empty, not finite, or longer than " + std::to_string(kMostTaps) + " samples");
  }
  separator.equalise(measured);
  for (const HeadResponse& one : measured)
    parts.push_back({one.towards.normalized(), separator.separated(one.left), separator.separated(one.right)});
  Hrtf made;
  for (int e = 0; e < kElevations; ++e) {
    for (int a = 0; a < kAzimuths; ++a) {
      const double up = (e * kStep_degrees - 90) * std::numbers::pi / 180,
                   round = a * kStep_degrees * std::numbers::pi / 180;
      made.nodes_.push_back(
          interpolated(parts, {std::cos(up) * std::cos(round), std::cos(up) * std::sin(round), std::sin(up)}, rate_hz));
    }
  }
  const EarPair ahead = made.nodes_[static_cast<std::size_t>((kElevations / 2) * kAzimuths)];
  const double power = 0.5 * (drilling_power(ahead.left.filter, rate_hz) + drilling_power(ahead.right.filter, rate_hz));
  if (power < 1e-12) return failure(ErrorCode::invalid_input, "nothing is heard from straight ahead");
  // From straight ahead, the sound passes the middle of the head when it reaches the ears.
  const double delay_s = 0.5 * (ahead.left.delay_s + ahead.right.delay_s);
  for (EarPair& node : made.nodes_) {
    for (EarResponse* ear : {&node.left, &node.right}) {
      for (float& x : ear->filter) x *= static_cast<float>(1.0 / std::sqrt(power));
      ear->delay_s -= delay_s;
    }
  }
  return made;
}

void Hrtf::towards(const Vec3& direction, EarPair& ears) const noexcept {
  const double degrees = 180 / std::numbers::pi;
  const double up = (std::asin(std::clamp(direction.z(), -1.0, 1.0)) * degrees + 90) / kStep_degrees;
  double round = std::atan2(direction.y(), direction.x()) * degrees / kStep_degrees;
  if (round < 0) round += kAzimuths;
  const int e = std::clamp(static_cast<int>(up), 0, kElevations - 2);
  const int a = std::clamp(static_cast<int>(round), 0, kAzimuths - 1);
  const double share_up = up - e, share_round = round - a;
  ears = EarPair{};
  for (const int de : {0, 1}) {
    for (const int da : {0, 1}) {
      const double weight = (de == 1 ? share_up : 1 - share_up) * (da == 1 ? share_round : 1 - share_round);
      if (weight == 0) continue;
      const EarPair& node = nodes_[static_cast<std::size_t>((e + de) * kAzimuths + (a + da) % kAzimuths)];
      add(ears.left, node.left, weight);
      add(ears.right, node.right, weight);
    }
  }
}

}  // namespace osteon::audio
