// Windows, the transform, and the short-time transform: energies and identities in closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <complex>

#include "common/sound/fourier.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/stft.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::sound {
namespace {

TEST(HannWindow, HasItsEnergyAndSumsToOne) {
  for (const int size : {2, 16, 512, 4096}) {
    const std::vector<float> window = hann_window(size);
    // The mean of (1 - cos)^2 / 4 over whole turns is 3 / 8. With two samples, the cosine's square is always 1.
    EXPECT_NEAR(window_energy(window), size == 2 ? 1.0 : 3.0 / 8.0 * size, 1e-5 * size) << size;
    for (std::size_t i = 0; i < window.size() / 2; ++i)
      ASSERT_NEAR(window[i] + window[i + window.size() / 2], 1.0F, 1e-6F) << size;
  }
}

TEST(Fourier, KeepsTheEnergyAndComesBack) {
  constexpr int kSize = 1024;
  RealFft fft(kSize);
  const std::vector<float> noise = white_noise(0.3, kSize, 7);
  std::vector<std::complex<float>> bins(fft.bins());
  fft.forward(noise, bins);
  // Parseval: the inner bins stand for both signs of the frequency.
  double sum = std::norm(bins.front()) + std::norm(bins.back());
  for (std::size_t k = 1; k + 1 < bins.size(); ++k) sum += 2.0 * std::norm(bins[k]);
  EXPECT_NEAR(sum / kSize, energy(noise), 1e-5 * energy(noise));
  std::vector<float> back(kSize);
  fft.inverse(bins, back);
  for (int i = 0; i < kSize; ++i) ASSERT_NEAR(back[i], noise[i], 1e-6);
}

TEST(Fourier, PhaseIsThatAtTheFirstSample) {
  constexpr int kSize = 64;
  RealFft fft(kSize);
  std::vector<std::complex<float>> bins(fft.bins());
  fft.forward(tone(5.0, 1.0, kSize, kSize), bins);
  // sin = (e^jx - e^-jx) / 2j: half of the size, a quarter of a turn back.
  EXPECT_NEAR(bins[5].real(), 0.0F, 1e-4F);
  EXPECT_NEAR(bins[5].imag(), -kSize / 2.0F, 1e-4F);
}

TEST(Stft, InverseIsTheSignalForEveryFraming) {
  for (const std::size_t count : {std::size_t{1}, std::size_t{511}, std::size_t{5000}, std::size_t{4096}})
    for (const StftParams& params : {StftParams{1024, 512, 1024}, StftParams{512, 128, 512}, StftParams{256, 100, 1024},
                                     StftParams{441 + 1, 221, 512}}) {
      const std::vector<float> noise = white_noise(0.2, count, 3);
      const Stft transform = stft(noise, kAnalysed_hz, params);
      const std::vector<float> back = inverse_stft(transform);
      ASSERT_EQ(back.size(), count);
      for (std::size_t i = 0; i < count; ++i) ASSERT_NEAR(back[i], noise[i], 2e-6) << i << " of " << count;
    }
}

TEST(Stft, BandPowerOfAToneIsHalfItsSquare) {
  const Stft transform = stft(tone(2000.0, 0.5, 22050, kAnalysed_hz), kAnalysed_hz, {512, 128, 512});
  const std::size_t middle = transform.frames / 2;
  const double scale = power_scale(transform.params);
  const auto power = [&](double from_hz, double to_hz) {
    return scale * band_energy(transform.frame(middle), kAnalysed_hz, from_hz, to_hz);
  };
  EXPECT_NEAR(power(1700, 2300), 0.125, 0.125 * 1e-3);
  // Further than the main lobe, the side lobes of a Hann window fall below -31 dB.
  EXPECT_LT(power_db(power(2600, 11025)), power_db(0.125) - 40);
}

TEST(Stft, MiddlesOfFramesCoverTheSignal) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{512}, std::size_t{513}}) {
    const Stft transform = stft(std::vector<float>(count, 0.1F), kAnalysed_hz, {1024, 512, 1024});
    EXPECT_GE((transform.frames - 1) * 512 + 1, count);
  }
}

TEST(Spectrogram, SumsToTheMeanSquareInEachColumn) {
  // 1000 Hz in the first second, and four times its power at 5000 Hz in the second.
  std::vector<float> samples = tone(1000, 0.2, 22050, kAnalysed_hz);
  const std::vector<float> louder = tone(5000, 0.4, 22050, kAnalysed_hz);
  samples.insert(samples.end(), louder.begin(), louder.end());
  for (const std::size_t most : {std::size_t{2000}, std::size_t{50}, std::size_t{7}}) {
    const Spectrogram s = spectrogram(samples, kAnalysed_hz, 512, most);
    EXPECT_LE(s.columns, most);
    EXPECT_GE(2 * s.columns, std::min<std::size_t>(most, 346));
    for (const double time_s : {0.5, 1.5}) {
      const auto column = static_cast<std::size_t>(time_s / s.column_s);
      double sum = 0;
      std::size_t loudest = 0;
      for (std::size_t k = 0; k < s.bins; ++k) {
        sum += s.at(column, k);
        if (s.at(column, k) > s.at(column, loudest)) loudest = k;
      }
      EXPECT_NEAR(sum, time_s < 1 ? 0.02 : 0.08, 2e-4) << time_s << " of " << most;
      EXPECT_NEAR(static_cast<double>(loudest) * s.bin_hz, time_s < 1 ? 1000 : 5000, 0.51 * s.bin_hz);
    }
  }
}

}  // namespace
}  // namespace osteon::sound
