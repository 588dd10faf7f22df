#include "common/sound/wavelet_packets.hpp"

#include <algorithm>
#include <array>

#include "common/core/check.hpp"

namespace osteon::sound {
namespace {

constexpr std::size_t kTaps = 20;

// Low-pass filter of Daubechies' orthonormal wavelet with 10 vanishing moments and extremal phase (Daubechies 1992).
constexpr std::array<double, kTaps> kLow = {
    0.026670057900555568,    0.18817680007769166,     0.52720118893172552,    0.68845903945360465,
    0.28117234366057597,     -0.24984642432731499,    -0.19594627437737769,   0.127369340335795,
    0.093057364603570669,    -0.071394147166396207,   -0.029457536821876223,  0.033212674059341259,
    0.0036065535669560266,   -0.010733175483330514,   0.0013953517470528744,  0.0019924052951850678,
    -0.00068585669495971487, -0.00011646685512928512, 9.3588670320069646e-05, -1.3264202894521261e-05};

// The quadrature mirror of the low-pass filter.
constexpr std::array<double, kTaps> kHigh = [] {
  std::array<double, kTaps> high{};
  for (std::size_t k = 0; k < kTaps; ++k) high[k] = (k % 2 == 0 ? 1.0 : -1.0) * kLow[kTaps - 1 - k];
  return high;
}();

using Filter = std::array<double, kTaps>;

// Even samples of the correlation of `signal` with the filter, periodic.
std::vector<float> decimated(std::span<const float> signal, const Filter& filter) {
  const std::size_t n = signal.size();
  std::vector<float> half(n / 2);
  for (std::size_t i = 0; i < half.size(); ++i) {
    double sum = 0;
    if (2 * i + kTaps <= n) {
      const float* x = signal.data() + 2 * i;
      for (std::size_t k = 0; k < kTaps; ++k) sum += filter[k] * x[k];
    } else {
      for (std::size_t k = 0; k < kTaps; ++k) sum += filter[k] * signal[(2 * i + k) % n];
    }
    half[i] = static_cast<float>(sum);
  }
  return half;
}

// The transpose of decimated(). With orthonormal filters it is the inverse, for this part of the signal.
std::vector<float> interpolated(std::span<const float> half, const Filter& filter) {
  const std::size_t n = 2 * half.size();
  std::vector<double> sum(n, 0.0);
  for (std::size_t i = 0; i < half.size(); ++i) {
    const double x = half[i];
    if (x == 0.0) continue;
    if (2 * i + kTaps <= n) {
      for (std::size_t k = 0; k < kTaps; ++k) sum[2 * i + k] += filter[k] * x;
    } else {
      for (std::size_t k = 0; k < kTaps; ++k) sum[(2 * i + k) % n] += filter[k] * x;
    }
  }
  return {sum.begin(), sum.end()};
}

// Of a band and its two halves, the upper one comes from the high-pass filter if the band is an even one, and from the
// low-pass filter if it is an odd one, because its spectrum is turned round.
bool takes_high(int index) { return (index % 2 != 0) != (index / 2 % 2 != 0); }

const Filter& filter_to(int index) { return takes_high(index) ? kHigh : kLow; }

}  // namespace

Band packet_band(const Packet& packet, double rate_hz) {
  const double width = 0.5 * rate_hz / (1 << packet.level);
  return {packet.index * width, (packet.index + 1) * width};
}

std::string packet_name(const Packet& packet) {
  std::string name;
  for (int index = packet.index, level = packet.level; level > 0; --level, index /= 2)
    name += takes_high(index) ? 'D' : 'A';
  return name + std::to_string(packet.level);
}

WaveletPackets wavelet_packets(std::span<const float> samples, double rate_hz, int levels) {
  OSTEON_CHECK(levels >= 1 && levels <= kMostLevels && rate_hz > 0);
  // Samples on which one coefficient of the last level depends, and then a multiple of its spacing.
  const std::size_t spacing = std::size_t{1} << levels;
  const std::size_t silence = (spacing - 1) * (kTaps - 1);
  std::vector<float> padded(samples.begin(), samples.end());
  padded.resize((samples.size() + silence + spacing - 1) / spacing * spacing, 0.0F);

  WaveletPackets packets{.rate_hz = rate_hz, .samples = samples.size(), .levels = {}};
  for (int level = 1; level <= levels; ++level) {
    std::vector<std::vector<float>> bands;
    for (int index = 0; index < 1 << level; ++index) {
      const std::span<const float> parent = level == 1 ? padded : packets.at({level - 1, index / 2});
      bands.push_back(decimated(parent, filter_to(index)));
    }
    packets.levels.push_back(std::move(bands));
  }
  return packets;
}

std::vector<float> band_signal(const WaveletPackets& packets, const Packet& packet) {
  std::vector<float> signal = packets.at(packet);
  for (int index = packet.index, level = packet.level; level > 0; --level, index /= 2)
    signal = interpolated(signal, filter_to(index));
  signal.resize(packets.samples);
  return signal;
}

std::vector<double> energy_shares(const WaveletPackets& packets, int level) {
  std::vector<double> shares;
  double all = 0;
  for (const std::vector<float>& band : packets.levels[static_cast<std::size_t>(level) - 1]) {
    double sum = 0;
    for (const float x : band) sum += static_cast<double>(x) * x;
    shares.push_back(sum);
    all += sum;
  }
  if (all > 0)
    for (double& share : shares) share /= all;
  return shares;
}

std::vector<Packet> drilling_bands() {
  std::vector<Packet> bands;
  for (int index = 0; index < 8; ++index) bands.push_back({4, index});
  for (int index = 4; index < 8; ++index) bands.push_back({3, index});
  return bands;
}

}  // namespace osteon::sound
