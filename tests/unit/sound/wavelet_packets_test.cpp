// Wavelet packets: tones land where the filters' closed form says, and bands sum to the signal.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/sound/levels.hpp"
#include "common/sound/wavelet_packets.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::sound {
namespace {

constexpr int kMoments = 10;

// Half of the squared gain of Daubechies' low-pass filter at `turns` of a turn in each sample: with p = cos^2(pi
// turns), the probability of at least N successes in 2 N - 1 trials (Daubechies 1992).
double low_part(double turns) {
  const double p = std::pow(std::cos(std::numbers::pi * turns), 2.0);
  double sum = 0;
  for (int k = kMoments; k < 2 * kMoments; ++k) {
    const double ways = std::tgamma(2 * kMoments) / (std::tgamma(k + 1) * std::tgamma(2 * kMoments - k));
    sum += ways * std::pow(p, k) * std::pow(1.0 - p, 2 * kMoments - 1 - k);
  }
  return sum;
}

// Part of a tone's power in a band: the product of the filters' parts on the way to it. The last filter comes first in
// the name. Decimation doubles the turns, and mirrors what is beyond half a turn.
double expected_share(const Packet& packet, double hz) {
  double turns = hz / kAnalysed_hz, share = 1.0;
  const std::string name = packet_name(packet);
  for (int level = 1; level <= packet.level; ++level) {
    const bool high = name[static_cast<std::size_t>(packet.level - level)] == 'D';
    share *= high ? 1.0 - low_part(turns) : low_part(turns);
    turns = turns < 0.25 ? 2.0 * turns : 1.0 - 2.0 * turns;
  }
  return share;
}

TEST(WaveletPackets, NamesFollowTheGrayCode) {
  EXPECT_EQ(packet_name({1, 0}), "A1");
  EXPECT_EQ(packet_name({1, 1}), "D1");
  EXPECT_EQ(packet_name({4, 0}), "AAAA4");
  EXPECT_EQ(packet_name({4, 1}), "DAAA4");
  EXPECT_EQ(packet_name({4, 2}), "DDAA4");
  EXPECT_EQ(packet_name({4, 3}), "ADAA4");
  EXPECT_EQ(packet_name({3, 4}), "ADD3");
  EXPECT_EQ(packet_name({3, 7}), "AAD3");
  for (int level = 1; level <= kMostLevels; ++level) {
    std::set<std::string> names;
    for (int index = 0; index < 1 << level; ++index) names.insert(packet_name({level, index}));
    EXPECT_EQ(names.size(), std::size_t{1} << level);
  }
}

TEST(WaveletPackets, BandsAreThoseOfTheFrequencies) {
  // ADAA4 and ADD3 by their letters; 8.5.3 prints 1378-2067 and 8268-9646 Hz.
  const Band adaa = packet_band({4, 3}, kAnalysed_hz), add = packet_band({3, 4}, kAnalysed_hz);
  EXPECT_NEAR(adaa.from_hz, 2067, 1);
  EXPECT_NEAR(adaa.to_hz, 2756, 1);
  EXPECT_NEAR(add.from_hz, 5512, 1);
  EXPECT_NEAR(add.to_hz, 6890, 1);
}

TEST(WaveletPackets, AToneLandsInItsBandOfAllThirtyTwo) {
  for (int index = 0; index < 32; ++index) {
    const Band band = packet_band({5, index}, kAnalysed_hz);
    const double hz = 0.5 * (band.from_hz + band.to_hz);
    const WaveletPackets packets = wavelet_packets(tone(hz, 0.4, 44100, kAnalysed_hz), kAnalysed_hz);
    for (int level = 1; level <= kMostLevels; ++level) {
      const std::vector<double> shares = energy_shares(packets, level);
      for (int other = 0; other < 1 << level; ++other) {
        const double share = shares[static_cast<std::size_t>(other)];
        // The ends of the tone, some hundred samples of 44100, belong to all bands.
        EXPECT_NEAR(share, expected_share({level, other}, hz), 0.005) << hz << " Hz in " << level << "," << other;
      }
      EXPECT_EQ(std::ranges::max_element(shares) - shares.begin(), index >> (kMostLevels - level))
          << hz << " Hz at level " << level;
    }
  }
}

TEST(WaveletPackets, AToneInTheMiddleOfABandStaysThere) {
  for (const auto& [level, least] : {std::pair{3, 0.80}, std::pair{4, 0.66}, std::pair{5, 0.58}})
    for (int index = 0; index < 1 << level; ++index) {
      const Band band = packet_band({level, index}, kAnalysed_hz);
      EXPECT_GT(expected_share({level, index}, 0.5 * (band.from_hz + band.to_hz)), least) << level << "," << index;
    }
}

TEST(WaveletPackets, EachLevelHasTheEnergyOfTheSignal) {
  for (const std::size_t count : {std::size_t{1}, std::size_t{33}, std::size_t{10000}}) {
    const std::vector<float> noise = white_noise(0.3, count, 5);
    const WaveletPackets packets = wavelet_packets(noise, kAnalysed_hz);
    for (int level = 1; level <= kMostLevels; ++level) {
      double sum = 0;
      for (int index = 0; index < 1 << level; ++index) sum += energy(packets.at({level, index}));
      EXPECT_NEAR(sum, energy(noise), 1e-5 * energy(noise)) << count << " at " << level;
    }
  }
}

TEST(WaveletPackets, BandsOfALevelSumToTheSignal) {
  const std::vector<float> noise = white_noise(0.3, 5003, 11);
  const WaveletPackets packets = wavelet_packets(noise, kAnalysed_hz);
  std::vector<std::vector<Packet>> divisions{drilling_bands()};
  for (int level = 1; level <= kMostLevels; ++level) {
    divisions.emplace_back();
    for (int index = 0; index < 1 << level; ++index) divisions.back().push_back({level, index});
  }
  for (const std::vector<Packet>& bands : divisions) {
    std::vector<float> sum(noise.size(), 0.0F);
    for (const Packet& packet : bands) sum = added(sum, band_signal(packets, packet));
    for (std::size_t i = 0; i < noise.size(); ++i) ASSERT_NEAR(sum[i], noise[i], 5e-6) << bands.size() << " at " << i;
  }
}

TEST(WaveletPackets, ABandSoundsWhenItsToneDoes) {
  // 300 Hz in the first half, 6200 Hz in the second: the bands of Figure 8.15.
  std::vector<float> samples = tone(300, 0.3, 44100, kAnalysed_hz);
  const std::vector<float> high = tone(6200, 0.3, 44100, kAnalysed_hz);
  std::copy(high.begin() + 22050, high.end(), samples.begin() + 22050);
  const WaveletPackets packets = wavelet_packets(samples, kAnalysed_hz);
  const std::vector<float> low_band = band_signal(packets, {4, 0}), high_band = band_signal(packets, {3, 4});
  // A filter of level 4 is 286 samples long.
  const auto first = std::span(low_band).subspan(1000, 20000), second = std::span(low_band).subspan(23000, 20000);
  EXPECT_NEAR(rms_db(first), rms_db(std::span(samples).first(20000)), 0.1);
  EXPECT_LT(rms_db(second), rms_db(first) - 60);
  // The rest of the power is in the neighbour across 5512 Hz.
  EXPECT_NEAR(rms_db(std::span(high_band).subspan(23000, 20000)),
              rms_db(std::span(samples).subspan(23000, 20000)) + power_db(expected_share({3, 4}, 6200)), 0.02);
  EXPECT_LT(rms_db(std::span(high_band).subspan(1000, 20000)), -60);
}

TEST(WaveletPackets, SilenceHasNoShare) {
  const WaveletPackets packets = wavelet_packets(std::vector<float>(1000, 0.0F), kAnalysed_hz);
  EXPECT_EQ(energy_shares(packets, 5), std::vector<double>(32, 0.0));
  EXPECT_EQ(peak(band_signal(packets, {5, 3})), 0.0);
}

}  // namespace
}  // namespace osteon::sound
