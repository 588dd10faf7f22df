#include "tests/perf/classifier/sound_features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "common/sound/random.hpp"
#include "common/sound/stft.hpp"

namespace osteon::test {
namespace {

constexpr double kSampled_hz = 48000;
constexpr sound::StftParams kFrames{.window = static_cast<int>(kFrame_s * kSampled_hz),
                                    .hop = static_cast<int>(kFrameStep_s * kSampled_hz),
                                    .size = 4096};
constexpr double kBin_hz = kSampled_hz / kFrames.size;
// Third octaves from 50 Hz to 16 kHz. In those below 200 Hz a line cannot stand out: they have less than four bins.
constexpr int kBands = 25, kFirstLined = 6;
constexpr int kAside = 5;  // frames between a window and the next that shares no sample with it
constexpr double kFloor = 1e-12;

double band_edge_hz(int band) { return 50.0 * std::exp2(band / 3.0); }

struct Heard {
  std::array<double, kBands> level{}, line{};  // natural logarithms
  double power = 0;
};

Heard heard(std::span<const std::complex<float>> bins, double scale, double faster) {
  Heard frame;
  for (const auto& bin : bins) frame.power += 2.0 * scale * static_cast<double>(std::norm(bin));
  for (int band = 0; band < kBands; ++band) {
    const auto from = static_cast<std::size_t>(std::ceil(faster * band_edge_hz(band) / kBin_hz));
    const auto to =
        std::min(bins.size(), static_cast<std::size_t>(std::ceil(faster * band_edge_hz(band + 1) / kBin_hz)));
    double sum = 0, most = 0;
    for (std::size_t k = from; k < to; ++k) {
      const double power = 2.0 * scale * static_cast<double>(std::norm(bins[k]));
      sum += power;
      most = std::max(most, power);
    }
    frame.level[static_cast<std::size_t>(band)] = std::log(sum + kFloor);
    frame.line[static_cast<std::size_t>(band)] =
        std::log((most + kFloor) * static_cast<double>(std::max<std::size_t>(1, to - from)) / (sum + kFloor));
  }
  return frame;
}

// Levels, lines, change, rise and fall of one frame.
Eigen::RowVectorXd spectrum_row(const Heard& before, const Heard& now, const Heard& after, bool equal_rms) {
  constexpr int kLines = kBands - kFirstLined;
  Eigen::RowVectorXd row(2 * kBands + kLines + 2);
  const auto level = [&](const Heard& frame, int band) {
    const double own = equal_rms ? std::log(frame.power + kFloor) : 0.0;
    return frame.level[static_cast<std::size_t>(band)] - own;
  };
  double rise = 0, fall = 0;
  for (int band = 0; band < kBands; ++band) {
    const double change = level(after, band) - level(before, band);
    const double step = level(now, band) - level(before, band);
    (step > 0 ? rise : fall) += std::abs(step) / kBands;
    row(band) = level(now, band);
    row(kBands + band) = change;
  }
  for (int i = 0; i < kLines; ++i) row(2 * kBands + i) = now.line[static_cast<std::size_t>(kFirstLined + i)];
  row(2 * kBands + kLines) = rise;
  row(2 * kBands + kLines + 1) = fall;
  return row;
}

}  // namespace

Eigen::MatrixXd features(std::span<const float> samples, Hearing hearing, double faster) {
  std::vector<Heard> frames;
  const double scale = sound::power_scale(kFrames);
  sound::for_each_frame(samples, kFrames, [&](std::size_t, std::span<const std::complex<float>> bins) {
    frames.push_back(heard(bins, scale, faster));
  });
  const auto count = std::ssize(frames);
  const auto at = [&](std::ptrdiff_t m) -> const Heard& {
    return frames[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(m, 0, count - 1))];
  };
  Eigen::MatrixXd rows;
  for (std::ptrdiff_t m = 0; m < count; ++m) {
    Eigen::RowVectorXd row;
    if (hearing == Hearing::level_only)
      row = Eigen::RowVectorXd::Constant(1, 10.0 * std::log10(at(m).power + kFloor));
    else
      row = spectrum_row(at(m - kAside), at(m), at(m + kAside), hearing == Hearing::equal_rms);
    if (rows.size() == 0) rows.resize(count, row.size());
    rows.row(m) = row;
  }
  return rows;
}

std::vector<float> with_noise(std::span<const float> samples, double from_s, double to_s, double snr_db,
                              std::uint64_t seed) {
  const auto from = static_cast<std::size_t>(from_s * kSampled_hz);
  const auto to = std::min(samples.size(), static_cast<std::size_t>(to_s * kSampled_hz));
  double power = 0;
  for (std::size_t i = from; i < to; ++i) power += static_cast<double>(samples[i]) * samples[i];
  const double rms = std::sqrt(power / static_cast<double>(std::max<std::size_t>(1, to - from)));
  const double noise_rms = rms * std::pow(10.0, -snr_db / 20.0);
  sound::Random random(seed);
  std::vector<float> noisy(samples.begin(), samples.end());
  for (float& x : noisy) {
    // Box and Muller.
    const double radius = std::sqrt(-2.0 * std::log(1.0 - random.unit()));
    x += static_cast<float>(noise_rms * radius * std::cos(2.0 * std::numbers::pi * random.unit()));
  }
  return noisy;
}

}  // namespace osteon::test
