// Measures of likeness against values that are computed by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "common/sound/likeness.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::sound {
namespace {

const double kHalf_db = 20.0 * std::log10(2.0);

std::vector<float> scaled(std::vector<float> samples, double gain, std::size_t from = 0) {
  for (std::size_t i = from; i < samples.size(); ++i) samples[i] *= static_cast<float>(gain);
  return samples;
}

TEST(Likeness, SnrIsSignalOverDifference) {
  // (9 + 16) / (1 + 0)
  EXPECT_NEAR(snr_db(std::vector<float>{3, 4}, std::vector<float>{2, 4}), 10.0 * std::log10(25.0), 1e-9);
  // A difference of twice the signal: (9 + 16) / (36 + 64)
  EXPECT_NEAR(snr_db(std::vector<float>{3, 4}, std::vector<float>{-3, -4}), -kHalf_db, 1e-9);
  EXPECT_EQ(snr_db(std::vector<float>{3, 4}, std::vector<float>{3, 4}), 200.0);
  EXPECT_EQ(snr_db(std::vector<float>{0, 0}, std::vector<float>{1, 0}), 0.0);
}

TEST(Likeness, AGainIsItsDecibelsInAllSpectraAndLevels) {
  const std::vector<float> noise = white_noise(0.1, 22050, 1), half = scaled(noise, 0.5);
  for (const auto& [x, y] : {std::pair{noise, half}, std::pair{half, noise}}) {
    EXPECT_NEAR(psd_lsd_db(x, y, kAnalysed_hz), kHalf_db, 1e-4);
    EXPECT_NEAR(mel_lsd_db(x, y, kAnalysed_hz), kHalf_db, 1e-4);
    EXPECT_NEAR(envelope_error_db(x, y, kAnalysed_hz), kHalf_db, 1e-4);
  }
  const std::vector<float> turned = scaled(noise, -1.0);
  EXPECT_NEAR(psd_lsd_db(noise, turned, kAnalysed_hz), 0.0, 1e-4);
  EXPECT_NEAR(mel_lsd_db(noise, turned, kAnalysed_hz), 0.0, 1e-4);
  EXPECT_NEAR(envelope_error_db(noise, turned, kAnalysed_hz), 0.0, 1e-4);
}

TEST(Likeness, ThePsdSeesABandByItsShareOfTheBins) {
  // Impulses have flat spectra: x = 1, y = 1 + a z^-1 with |Y|^2 = 1 + a^2 + 2 a cos w. One impulse in the middle of
  // each Welch window of 4096 samples keeps the ratio at every bin.
  std::vector<float> x(4096, 0.0F), y;
  x[2048] = 1.0F;
  y = x;
  const double a = 0.5;
  y[2049] = static_cast<float>(a);
  double squares = 0;
  int count = 0;
  for (int k = 0; k <= 2048; ++k) {
    const double hz = k * kAnalysed_hz / 4096;
    if (hz < 100 || hz > 10000) continue;
    const double db = 10.0 * std::log10(1 + a * a + 2 * a * std::cos(2 * std::numbers::pi * k / 4096));
    squares += db * db, ++count;
  }
  EXPECT_NEAR(psd_lsd_db(x, y, kAnalysed_hz), std::sqrt(squares / count), 1e-3);
}

TEST(Likeness, MelEdgesAreEquallyFarApartInMel) {
  // 1 + f / 700 is 1, 17/7 and (17/7)^2: equal ratios.
  const std::vector<double> edges = mel_edges_hz({.bands = 1, .from_hz = 0, .to_hz = 700.0 * (289.0 / 49.0 - 1.0)});
  ASSERT_EQ(edges.size(), 3U);
  EXPECT_NEAR(edges[0], 0.0, 1e-9);
  EXPECT_NEAR(edges[1], 1000.0, 1e-6);
  EXPECT_EQ(mel_edges_hz({}).size(), 66U);
  EXPECT_NEAR(mel_edges_hz({}).front(), 50.0, 1e-9);
  EXPECT_NEAR(mel_edges_hz({}).back(), 10000.0, 1e-6);
}

TEST(Likeness, AMelBandIsATriangle) {
  // A tone at the top of the triangle 0, 1000, 3428.6 Hz, and one half-way down, whose weight is one half.
  const MelBands band{.bands = 1, .from_hz = 0, .to_hz = 700.0 * (289.0 / 49.0 - 1.0), .window = 2048, .hop = 2048};
  const std::vector<float> top = tone(1000, 0.5, 2048, kAnalysed_hz);
  const std::vector<float> flank = tone(0.5 * (1000 + band.to_hz), 0.5, 2048, kAnalysed_hz);
  EXPECT_NEAR(mel_lsd_db(top, flank, kAnalysed_hz, band), 10.0 * std::log10(2.0), 0.1);
}

TEST(Likeness, MelFramesCountEqually) {
  const MelBands two{.window = 512, .hop = 512};
  const std::vector<float> noise = white_noise(0.1, 1024, 2);
  // 20 dB in one frame of two.
  EXPECT_NEAR(mel_lsd_db(noise, scaled(noise, 0.1, 512), kAnalysed_hz, two), 20.0 / std::sqrt(2.0), 1e-3);
  // The second frame is 50 dB below the first: it does not count.
  const std::vector<float> fading = scaled(noise, std::pow(10.0, -50.0 / 20.0), 512);
  EXPECT_NEAR(mel_lsd_db(fading, scaled(fading, 0.1, 512), kAnalysed_hz, two), 0.0, 1e-6);
  // Below the floor all is silence.
  const MelBands deaf{.window = 512, .hop = 512, .floor = 1e9};
  EXPECT_EQ(mel_lsd_db(noise, scaled(noise, 0.1), kAnalysed_hz, deaf), 0.0);
  EXPECT_EQ(mel_lsd_db(std::vector<float>(100, 0.1F), std::vector<float>(100, 0.2F), kAnalysed_hz, two), 0.0);
}

TEST(Likeness, BlocksOfTenMillisecondsCountEqually) {
  const std::vector<float> flat(22 * 10, 0.5F);  // ten blocks at 2205 Hz
  EXPECT_NEAR(envelope_error_db(flat, scaled(flat, 0.1, 22 * 9), 2205), 20.0 / std::sqrt(10.0), 1e-4);
  const std::vector<float> fading = scaled(flat, 0.005, 22 * 5);  // 46 dB below
  EXPECT_NEAR(envelope_error_db(fading, scaled(fading, 0.1, 22 * 5), 2205), 0.0, 1e-6);
  // Half a block at the end does not count.
  const std::vector<float> more(22 * 10 + 11, 0.5F);
  EXPECT_NEAR(envelope_error_db(more, scaled(more, 0.1, 22 * 10), 2205), 0.0, 1e-6);
}

}  // namespace
}  // namespace osteon::sound
