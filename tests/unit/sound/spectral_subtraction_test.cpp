// Spectral subtraction: what is left of white noise, and how much clearer a tone in it becomes.
#include <gtest/gtest.h>

#include "common/sound/levels.hpp"
#include "common/sound/spectral_subtraction.hpp"
#include "common/sound/tones.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::sound {
namespace {

constexpr std::size_t kCount = 20 * 22050;

double power_of(const Stft& transform) {
  double sum = 0;
  for (const auto& bin : transform.values) sum += std::norm(bin);
  return sum;
}

TEST(SpectralSubtraction, WhiteNoiseKeepsOneOverE) {
  const Stft noise = stft(white_noise(0.05, kCount, 1), kAnalysed_hz);
  const Stft other = stft(white_noise(0.05, kCount, 2), kAnalysed_hz);
  const Stft left = spectral_subtraction(other, stationary_spectrum(noise, 1, noise.frames - 1));
  // |N|^2 over its mean is exponentially distributed: E[max(0, x - 1)] = exp(-1). The spectra are means of 860 frames,
  // so their ratio is known to 7 % in a bin, and to 0.3 % over all bins.
  EXPECT_NEAR(power_of(left) / power_of(other), std::exp(-1.0), 0.01 * std::exp(-1.0));
}

TEST(SpectralSubtraction, MagnitudesLeaveLess) {
  const Stft noise = stft(white_noise(0.05, kCount, 1), kAnalysed_hz);
  const Stft other = stft(white_noise(0.05, kCount, 2), kAnalysed_hz);
  const Stft left =
      spectral_subtraction(other, stationary_spectrum(noise, 1, noise.frames - 1, SubtractionDomain::magnitude));
  // |N| is Rayleigh distributed with the mean m = sqrt(pi) / 2 for E|N|^2 = 1:
  // E[max(0, r - m)^2] = exp(-m^2) - sqrt(pi) m erfc(m).
  const double m = 0.5 * std::sqrt(std::numbers::pi);
  const double expected = std::exp(-m * m) - std::sqrt(std::numbers::pi) * m * std::erfc(m);
  EXPECT_NEAR(power_of(left) / power_of(other), expected, 0.015 * expected);
}

TEST(SpectralSubtraction, AToneInNoiseBecomesClearer) {
  const std::vector<float> clean = tone(3000, 0.1, kCount, kAnalysed_hz);
  const std::vector<float> noise = white_noise(0.05, kCount, 1), other = white_noise(0.05, kCount, 2);
  const Stft free = stft(noise, kAnalysed_hz);
  const std::vector<float> result = inverse_stft(
      spectral_subtraction(stft(added(clean, other), kAnalysed_hz), stationary_spectrum(free, 1, free.frames)));
  ASSERT_EQ(result.size(), kCount);
  const double before_db = 10.0 * std::log10(energy(clean) / energy(other));
  const double after_db = 10.0 * std::log10(energy(clean) / energy(differences(result, clean)));
  // The transform keeps exp(-1) of the noise, which is 4.34 dB. The transform has twice as many values as the
  // signal, and overlap-add is a projection: of errors that were independent it would keep half, 3 dB less.
  // Neighbouring frames are correlated a little, so it keeps more.
  EXPECT_GT(after_db - before_db, 4.34);
  EXPECT_LT(after_db - before_db, 4.34 + 3.01);
  EXPECT_NEAR(tone_db(result, kAnalysed_hz, 3000), 20.0 * std::log10(0.1), 0.1);
}

TEST(SpectralSubtraction, FreeSoundAloneIsAlmostGone) {
  // A steady tone is subtracted to nothing, whatever its frequency.
  const Stft steady = stft(tone(1119.84, 0.2, kCount, kAnalysed_hz), kAnalysed_hz);
  const std::vector<float> left = inverse_stft(spectral_subtraction(steady, stationary_spectrum(steady, 2, 800)));
  EXPECT_LT(rms_db(std::span(left).subspan(2000, kCount - 4000)), 20.0 * std::log10(0.2) - 3.01 - 20);
}

TEST(SpectralSubtraction, OfSilenceNothingIsChanged) {
  const Stft silence = stft(std::vector<float>(22050, 0.0F), kAnalysed_hz);
  const Stft noise = stft(white_noise(0.1, 22050, 4), kAnalysed_hz);
  EXPECT_EQ(power_of(spectral_subtraction(noise, stationary_spectrum(silence, 0, 10))), power_of(noise));
  EXPECT_EQ(power_of(spectral_subtraction(silence, stationary_spectrum(noise, 0, 10))), 0.0);
}

}  // namespace
}  // namespace osteon::sound
