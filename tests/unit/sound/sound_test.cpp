// Compares the measures of sound with signals whose level, frequency and brightness are known in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "common/sound/levels.hpp"
#include "common/sound/spectrum.hpp"
#include "common/sound/tones.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::sound {
namespace {

constexpr double kRate_hz = 48000.0;

std::vector<float> sine(double hz, double amplitude, std::size_t count) { return tone(hz, amplitude, count, kRate_hz); }

TEST(Levels, SineOfFullScaleIsThreeDecibelsBelow) {
  EXPECT_NEAR(rms_db(sine(1000, 1.0, 48000)), -3.0103, 1e-3);
  EXPECT_NEAR(rms_db(sine(1000, 0.1, 48000)), -23.0103, 1e-3);
  EXPECT_NEAR(peak(sine(1000, 0.5, 48000)), 0.5, 1e-6);
}

TEST(Levels, TwentyDecibelsAreTenTimesTheAmplitude) {
  EXPECT_DOUBLE_EQ(amplitude_of_db(0), 1);
  EXPECT_NEAR(amplitude_of_db(-20), 0.1, 1e-15);
  for (const double db : {-40.0, -6.0}) EXPECT_NEAR(rms_db(sine(1000, amplitude_of_db(db), 48000)), db - 3.0103, 1e-3);
}

TEST(Levels, APeakBelowZeroCountsAsOneAbove) {
  EXPECT_EQ(peak(std::vector<float>{0.25F, -0.75F, 0.5F}), 0.75);
  EXPECT_EQ(peak(std::vector<float>{-0.5F}), 0.5);
}

TEST(Levels, SilenceHasTheLowestLevelAndNoBrightness) {
  const std::vector<float> silence(8192, 0.0F);
  EXPECT_EQ(rms_db(silence), kSilence_db);
  EXPECT_EQ(rms_db({}), kSilence_db);
  EXPECT_EQ(centroid_hz(power_spectrum(silence, kRate_hz), 0, 24000), 0.0);
}

TEST(Levels, LargestStepIsTheSlopeOfASineAndFindsAClick) {
  std::vector<float> samples = sine(100, 1.0, 48000);
  EXPECT_NEAR(largest_step(samples), 2.0 * std::sin(std::numbers::pi * 100 / kRate_hz), 1e-4);
  samples[20000] += 0.5F;
  EXPECT_GT(largest_step(samples), 0.48);
}

TEST(Levels, OnePascalIsNinetyFourDecibels) {
  // A sine whose amplitude is full scale, of 1 Pa RMS.
  EXPECT_NEAR(sound_level_db(rms_db(sine(1000, 1.0, 48000)), std::sqrt(2.0)), 93.979, 1e-3);
  EXPECT_NEAR(sound_level_db(0.0, kReference_pa), 0.0, 1e-12);
}

TEST(Levels, BlocksHaveTheirOwnLevels) {
  std::vector<float> samples = sine(1000, 0.5, 4800);
  const std::vector<float> louder = sine(1000, 1.0, 4800);
  samples.insert(samples.end(), louder.begin(), louder.end());
  samples.resize(9600 + 10, 0.0F);
  const std::vector<double> levels = block_levels_db(samples, 4800);
  ASSERT_EQ(levels.size(), 3U);
  EXPECT_NEAR(levels[0], -9.031, 1e-3);
  EXPECT_NEAR(levels[1], -3.010, 1e-3);
  EXPECT_EQ(levels[2], kSilence_db);
}

TEST(Spectrum, SineHasAThirdOfItsSquareInItsBin) {
  // The Hann window's spectrum is 1/2 in its middle and 1/4 beside it, and its mean square is 3/8.
  constexpr int kSize = 4096, kBin = 300;
  const Spectrum spectrum = power_spectrum(sine(kBin * kRate_hz / kSize, 0.6, 48000), kRate_hz, kSize);
  EXPECT_NEAR(spectrum.power[kBin], 0.36 / 3, 1e-6);
  EXPECT_NEAR(spectrum.power[kBin - 1], 0.36 / 12, 1e-6);
  EXPECT_NEAR(spectrum.power[kBin + 1], 0.36 / 12, 1e-6);
  EXPECT_LT(spectrum.power[kBin + 2], 1e-10);
  EXPECT_NEAR(density_db(spectrum, kBin), 10 * std::log10(0.12 / (kRate_hz / kSize)), 1e-4);
}

TEST(Spectrum, WhiteNoiseHasOneDensityEverywhere) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal(0.0F, 0.1F);
  std::vector<float> noise(960000);
  for (float& x : noise) x = normal(random);
  const Spectrum spectrum = power_spectrum(noise, kRate_hz, 1024);
  // Twice the variance over the rate. 1874 frames that overlap by half give a bin to 3 %, so 0.6 dB are five sigmas.
  const double expected_db = 10 * std::log10(2 * 0.01 / kRate_hz);
  for (std::size_t k = 2; k + 2 < spectrum.power.size(); ++k)
    ASSERT_NEAR(density_db(spectrum, k), expected_db, 0.65) << k;
}

TEST(Spectrum, PowerSumsToTheMeanSquare) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0.0F, 0.1F);
  std::vector<float> noise(480000);
  for (float& x : noise) x = normal(random);
  // Ten seconds of noise: the mean square is known to sqrt(2 / 480000) = 0.2 %, and the windows weigh it unevenly.
  EXPECT_NEAR(band_db(power_spectrum(noise, kRate_hz), 0, 24001), rms_db(noise), 0.05);
  // White noise is flat: half of the band has half of the power, and its middle is the centroid.
  const Spectrum flat = power_spectrum(noise, kRate_hz);
  EXPECT_NEAR(band_db(flat, 0, 12000) - band_db(flat, 12000, 24000), 0.0, 0.1);
  EXPECT_NEAR(centroid_hz(flat, 0, 24000), 12000, 100);
}

TEST(Spectrum, AShortSignalHasItsOwnLevel) {
  // 60 ms, a third of a window, as a perforation may last. A spectrum has about 900 degrees of freedom, and the mean of
  // 50 is known to 0.03 dB.
  constexpr double kAnalysis_hz = 22050;
  const double long_db = band_db(power_spectrum(white_noise(0.1, 20 * 22050, 1), kAnalysis_hz), 0, 12000);
  double mean_db = 0;
  for (unsigned seed = 0; seed < 50; ++seed)
    mean_db += band_db(power_spectrum(white_noise(0.1, 1323, 100 + seed), kAnalysis_hz), 0, 12000) / 50;
  EXPECT_NEAR(mean_db, long_db, 0.3);
  // Fewer samples than a window can have are silent.
  EXPECT_EQ(band_db(power_spectrum(std::vector<float>(1, 1.0F), kAnalysis_hz), 0, 12000), kSilence_db);
}

TEST(Spectrum, CentroidOfTwoTonesIsTheirPowerWeightedMean) {
  const auto tones = added(sine(1000, 0.2, 96000), sine(5000, 0.1, 96000));
  // Powers 4 : 1.
  EXPECT_NEAR(centroid_hz(power_spectrum(tones, kRate_hz), 0, 24000), (4 * 1000 + 5000) / 5.0, 2.0);
}

TEST(Spectrum, StrongestPeaksAreTheTonesLoudestFirst) {
  const auto tones = added(added(sine(1234.5, 0.05, 96000), sine(3700.2, 0.2, 96000)), sine(9001.7, 0.1, 96000));
  const std::vector<Peak> peaks = strongest_peaks(power_spectrum(tones, kRate_hz), 3, 100);
  ASSERT_EQ(peaks.size(), 3U);
  // The parabola on a Hann lobe is accurate to a few hundredths of a bin of 11.7 Hz.
  EXPECT_NEAR(peaks[0].hz, 3700.2, 0.6);
  EXPECT_NEAR(peaks[1].hz, 9001.7, 0.6);
  EXPECT_NEAR(peaks[2].hz, 1234.5, 0.6);
  EXPECT_NEAR(peaks[0].level_db, 20 * std::log10(0.2) - 3.01, 0.1);
}

TEST(Tones, FrequencyAndAmplitudeOfOneAmongOthers) {
  const auto tones = added(sine(437.21, 0.3, 24000), sine(2000, 0.3, 24000));
  const Tone found = find_tone(tones, kRate_hz, 400, 480);
  EXPECT_NEAR(found.hz, 437.21, 0.01);
  EXPECT_NEAR(found.level_db, 20 * std::log10(0.3), 0.05);
  // Far from both, side lobes of the Hann window have fallen by more than 80 dB.
  EXPECT_LT(tone_db(tones, kRate_hz, 1200), -90);
}

TEST(Tones, TrackFollowsAGlide) {
  // f(t) = 1000 + 100 t: the phase is its integral.
  std::vector<float> glide(96000);
  for (std::size_t i = 0; i < glide.size(); ++i) {
    const double t = static_cast<double>(i) / kRate_hz;
    glide[i] = static_cast<float>(0.5 * std::sin(2.0 * std::numbers::pi * (1000 * t + 50 * t * t)));
  }
  const TrackParams params;
  const std::vector<double> track = track_tone(glide, kRate_hz, 1000, params);
  ASSERT_GT(track.size(), 80U);
  for (std::size_t i = 0; i < track.size(); ++i) {
    const double middle_s = (static_cast<double>(i) * params.hop + 0.5 * params.window) / kRate_hz;
    EXPECT_NEAR(track[i], 1000 + 100 * middle_s, 0.2) << "point " << i;
  }
}

}  // namespace
}  // namespace osteon::sound
