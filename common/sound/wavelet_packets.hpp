// Wavelet packets of a signal (8.12, 8.13), in the order of their frequencies, and the signal of each band in time.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace osteon::sound {

inline constexpr int kMostLevels = 5;

// Band `index` of level `level`, counted by frequency: 0 ... 2^level - 1.
struct Packet {
  int level = 1;
  int index = 0;
};

// The band's frequencies: index ... index + 1 times rate / 2^(level + 1). Neighbours overlap, because the filters are
// not ideal.
struct Band {
  double from_hz = 0, to_hz = 0;
};
[[nodiscard]] Band packet_band(const Packet& packet, double rate_hz);

// The filters that lead to the band, the last one first: A keeps the low half, D the high half. Decimation reverses the
// spectrum of a high half, so letters and frequencies are related by a Gray code: ADAA4 is band 3 of level 4. The
// lists in 8.5.3 take the letters as binary digits and so exchange bands.
[[nodiscard]] std::string packet_name(const Packet& packet);

// Samples of a decomposition. The filters are Daubechies' with 10 vanishing moments. They are orthonormal: each level
// has the energy of the signal.
struct WaveletPackets {
  double rate_hz = 0;
  std::size_t samples = 0;  // of the signal
  // levels[l - 1][index]: coefficients of a band of level l. Behind the signal, silence is added, longer than all
  // filters together. So nothing of its end reaches its beginning, although the filters are periodic.
  std::vector<std::vector<std::vector<float>>> levels;

  [[nodiscard]] const std::vector<float>& at(const Packet& packet) const {
    return levels[static_cast<std::size_t>(packet.level) - 1][static_cast<std::size_t>(packet.index)];
  }
};

// `levels`: 1 ... kMostLevels.
[[nodiscard]] WaveletPackets wavelet_packets(std::span<const float> samples, double rate_hz, int levels = kMostLevels);

// The part of the signal in one band: as many samples as the signal has. Those of all bands of a level, or of any other
// division of the frequencies into bands of the decomposition, sum to the signal.
[[nodiscard]] std::vector<float> band_signal(const WaveletPackets& packets, const Packet& packet);

// Part of the energy of a level that is in each of its 2^level bands. They sum to 1, or are all 0 for silence.
[[nodiscard]] std::vector<double> energy_shares(const WaveletPackets& packets, int level);

// The bands of Figure 8.14: level 4 for the lower half of the frequencies, level 3 for the upper one.
[[nodiscard]] std::vector<Packet> drilling_bands();

}  // namespace osteon::sound
