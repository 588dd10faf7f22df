// Noise, impacts and line segments: what goes in comes out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/sound/levels.hpp"
#include "common/sound/line_segments.hpp"
#include "common/sound/noise_model.hpp"
#include "common/sound/spectrum.hpp"
#include "common/sound/transients.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::sound {
namespace {

constexpr NoiseParams kWhole{.window = 256, .points = 32, .from_hz = 0, .to_hz = 0.5 * kAnalysed_hz};

TEST(NoiseModel, WhiteNoiseKeepsItsDensity) {
  const std::vector<float> noise = white_noise(0.1, 441000, 3);
  const std::vector<float> again = noise_sound(noise_model(noise, kAnalysed_hz, kWhole), noise.size(), 7);
  EXPECT_NEAR(rms_db(again), -20.0, 0.1);
  // Power 0.01, evenly over half of the rate. Bands are wide enough for an error of their mean of 0.05 dB.
  const Spectrum spectrum = power_spectrum(again, kAnalysed_hz);
  for (double hz = 250; hz < 5000; hz *= 2)
    EXPECT_NEAR(band_db(spectrum, hz, 2 * hz), 10.0 * std::log10(0.01 * hz / (0.5 * kAnalysed_hz)), 0.25) << hz;
}

TEST(NoiseModel, LevelsAreDensitiesInTheirTime) {
  std::vector<float> noise = white_noise(0.1, 44100, 3);
  for (std::size_t i = 22050; i < noise.size(); ++i) noise[i] *= 0.1F;
  const NoiseModel model = noise_model(noise, kAnalysed_hz, kWhole);
  const std::size_t points = model.points_hz.size(), step = 22050 / model.hop();
  const auto mean_db = [&](std::size_t first, std::size_t last) {
    double sum = 0;
    for (std::size_t m = first; m < last; ++m) sum += std::pow(10.0, model.levels_db[m * points + points - 5] / 10.0);
    return power_db(sum / static_cast<double>(last - first));
  };
  const double density_db = 10.0 * std::log10(0.01 / (0.5 * kAnalysed_hz));
  EXPECT_NEAR(mean_db(2, step - 1), density_db, 0.5);
  EXPECT_NEAR(mean_db(step + 2, model.frames - 3), density_db - 20.0, 0.5);

  const std::vector<float> again = noise_sound(model, noise.size(), 1);
  EXPECT_NEAR(rms_db(std::span(again).first(21900)), -20.0, 0.2);
  EXPECT_NEAR(rms_db(std::span(again).subspan(22200, 21000)), -40.0, 0.2);
}

TEST(NoiseModel, PointsBeginABinApart) {
  const std::vector<double> points = noise_points_hz(kAnalysed_hz, kWhole);
  ASSERT_EQ(points.size(), 32U);
  EXPECT_EQ(points.front(), 0.0);
  EXPECT_NEAR(points[1], kAnalysed_hz / 256, 1e-9);
  EXPECT_EQ(points.back(), 0.5 * kAnalysed_hz);
  for (std::size_t i = 1; i < points.size(); ++i) EXPECT_GE(points[i] - points[i - 1], kAnalysed_hz / 256 - 1e-6) << i;
  EXPECT_NEAR(points[30] / points[29], points[29] / points[28], 1e-6);
}

TEST(NoiseModel, LayersShareTheFrequencies) {
  const std::vector<float> noise = white_noise(0.1, 220500, 3);
  std::vector<float> sum(noise.size(), 0.0F);
  for (const NoiseParams& layer : {NoiseParams{1024, 32, 0, 1160}, NoiseParams{256, 26, 1160, 0.5 * kAnalysed_hz}})
    sum = added(sum, noise_sound(noise_model(noise, kAnalysed_hz, layer), noise.size(), 1));
  EXPECT_NEAR(rms_db(sum), -20.0, 0.15);
  const Spectrum spectrum = power_spectrum(sum, kAnalysed_hz);
  for (const double hz : {400.0, 1000.0, 2000.0})
    EXPECT_NEAR(band_db(spectrum, hz, hz + 400), 10.0 * std::log10(0.01 * 400 / (0.5 * kAnalysed_hz)), 0.4) << hz;
}

TEST(NoiseModel, WhatWasTakenAwayIsMadeUpFor) {
  // A gap of 20 ms, as an impact leaves it. Frames of 46 ms that see part of it keep their level.
  const NoiseParams low{.window = 1024, .points = 26, .from_hz = 0, .to_hz = 0.5 * kAnalysed_hz};
  std::vector<float> noise = white_noise(0.1, 22050, 3), weight(noise.size(), 1.0F);
  std::fill(weight.begin() + 11000, weight.begin() + 11441, 0.0F);
  for (std::size_t i = 0; i < noise.size(); ++i) noise[i] *= weight[i];
  const std::vector<float> again = noise_sound(noise_model(noise, kAnalysed_hz, low, weight), noise.size(), 1);
  EXPECT_NEAR(rms_db(std::span(again).subspan(11000, 441)), -20.0, 1.0);
  const std::vector<float> less = noise_sound(noise_model(noise, kAnalysed_hz, low), noise.size(), 1);
  EXPECT_LT(rms_db(std::span(less).subspan(11000, 441)), -21.5);
}

TEST(NoiseModel, TheSeedDecides) {
  const NoiseModel model = noise_model(white_noise(0.1, 5000, 3), kAnalysed_hz, kWhole);
  EXPECT_EQ(noise_sound(model, 5000, 5), noise_sound(model, 5000, 5));
  EXPECT_NE(noise_sound(model, 5000, 5), noise_sound(model, 5000, 6));
}

TEST(NoiseModel, SilenceStaysSilent) {
  const NoiseModel model = noise_model(std::vector<float>(1000, 0.0F), kAnalysed_hz, kWhole);
  EXPECT_LT(rms_db(noise_sound(model, 1000, 1)), -150);
}

// A quiet tone, and blows of noise that decay within some milliseconds.
std::vector<float> blows(const std::vector<std::size_t>& at) {
  std::vector<float> samples = tone(900, 0.01, 44100, kAnalysed_hz);
  const std::vector<float> noise = white_noise(0.3, 2000, 9);
  for (const std::size_t begin : at)
    for (std::size_t i = 0; i < noise.size(); ++i)
      samples[begin + i] += noise[i] * static_cast<float>(std::exp(-static_cast<double>(i) / 150.0));
  return samples;
}

TEST(Transients, ABlowIsFoundWhereItBegins) {
  const std::vector<std::size_t> at{5000, 15003, 30011};
  const std::vector<std::size_t> found = impacts(blows(at), kAnalysed_hz);
  ASSERT_EQ(found.size(), at.size());
  for (std::size_t i = 0; i < at.size(); ++i)
    EXPECT_NEAR(static_cast<double>(found[i]), static_cast<double>(at[i]), 0.0005 * kAnalysed_hz) << i;
}

TEST(Transients, WhatRisesSlowlyOrStaysIsNone) {
  EXPECT_TRUE(impacts(tone(900, 0.3, 44100, kAnalysed_hz), kAnalysed_hz).empty());
  EXPECT_TRUE(impacts(white_noise(0.1, 441000, 1), kAnalysed_hz).empty());
  std::vector<float> rising = white_noise(0.1, 22050, 1);
  for (std::size_t i = 0; i < rising.size(); ++i) rising[i] *= static_cast<float>(i) / 22050.0F;
  for (const std::size_t at : impacts(rising, kAnalysed_hz)) ADD_FAILURE() << at;
  EXPECT_TRUE(impacts(std::vector<float>(10, 1.0F), kAnalysed_hz).empty());
}

TEST(Transients, AreFewAndShort) {
  std::vector<std::size_t> at;
  for (std::size_t i = 1000; i + 2000 < 44100; i += 1000) at.push_back(i);
  const std::vector<float> samples = blows(at);
  const std::vector<std::size_t> found = impacts(samples, kAnalysed_hz);
  EXPECT_GE(found.size(), 8U);
  std::size_t stored = 0;
  for (const Transient& transient : transients_at(samples, kAnalysed_hz, found)) {
    EXPECT_LE(static_cast<double>(transient.samples.size()), 0.020 * kAnalysed_hz);
    stored += transient.samples.size();
  }
  EXPECT_LE(stored, samples.size() / 10);
}

TEST(Transients, TheSoundGivesWayToThem) {
  const std::vector<float> samples = blows({5000});
  const std::vector<std::size_t> found = impacts(samples, kAnalysed_hz);
  ASSERT_EQ(found.size(), 1U);
  // In place of the signal itself, nothing changes. In place of silence, what is between the flanks is there.
  const std::vector<Transient> transients = transients_at(samples, kAnalysed_hz, found);
  std::vector<float> same = samples, silent(samples.size(), 0.0F);
  put_transients(same, transients, kAnalysed_hz);
  put_transients(silent, transients, kAnalysed_hz);
  for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_NEAR(same[i], samples[i], 1e-6) << i;
  for (std::size_t i = found[0]; i < found[0] + 300; ++i) ASSERT_EQ(silent[i], samples[i]) << i;
  EXPECT_EQ(silent[4900], 0.0F);
  EXPECT_EQ(silent[5600], 0.0F);
}

Partial partial_with(std::size_t count, double (*level_db)(double), double (*hz)(double)) {
  Partial partial{.first = 7, .points = {}};
  for (std::size_t i = 0; i < count; ++i) {
    const auto t = static_cast<double>(i);
    partial.points.push_back({.hz = hz(t), .amplitude = std::pow(10.0, level_db(t) / 20.0)});
  }
  return partial;
}

TEST(LineSegments, ALineHasItsTwoEnds) {
  const Partial line = partial_with(
      100, [](double t) { return -20.0 - 0.3 * t; }, [](double t) { return 900 + 2 * t; });
  const std::vector<Knot> knots = knots_of(line);
  ASSERT_EQ(knots.size(), 2U);
  EXPECT_EQ(knots[0].frame, 7U);
  EXPECT_EQ(knots[1].frame, 106U);
  const Partial again = partial_of(knots);
  ASSERT_EQ(again.points.size(), line.points.size());
  EXPECT_EQ(again.first, 7U);
  for (std::size_t i = 0; i < line.points.size(); ++i) {
    EXPECT_NEAR(again.points[i].hz, line.points[i].hz, 1e-6);
    EXPECT_NEAR(again.points[i].amplitude, line.points[i].amplitude, 1e-9);
  }
}

TEST(LineSegments, ACornerOfEitherEnvelopeIsAKnot) {
  const auto level = [](double t) { return -20.0 - std::abs(t - 40.0); };
  const auto hz = [](double t) { return t < 60 ? 900.0 : 900.0 + 10.0 * (t - 60.0); };
  const std::vector<Knot> knots = knots_of(partial_with(100, level, hz));
  ASSERT_EQ(knots.size(), 4U);
  EXPECT_EQ(knots[1].frame, 47U);
  EXPECT_EQ(knots[2].frame, 67U);
}

TEST(LineSegments, NoPointIsFartherThanTheTolerance) {
  Partial partial{.first = 0, .points = {}};
  const std::vector<float> steps = white_noise(1.0, 400, 4);
  double hz = 2000, level_db = -30;
  for (std::size_t i = 0; i < 200; ++i) {
    hz += steps[2 * i], level_db += steps[2 * i + 1];
    partial.points.push_back({.hz = hz, .amplitude = std::pow(10.0, level_db / 20.0)});
  }
  const SegmentTolerance tolerance{.level_db = 1.5, .hz = 2.5, .part = 0};
  const std::vector<Knot> knots = knots_of(partial, tolerance);
  EXPECT_LT(knots.size(), 150U);
  const Partial again = partial_of(knots);
  for (std::size_t i = 0; i < 200; ++i) {
    EXPECT_LE(std::abs(again.points[i].hz - partial.points[i].hz), 2.5 + 1e-9);
    EXPECT_LE(std::abs(20.0 * std::log10(again.points[i].amplitude / partial.points[i].amplitude)), 1.5 + 1e-9);
  }
  EXPECT_EQ(knots_of({.first = 3, .points = {{.hz = 100, .amplitude = 0.1}}}).size(), 1U);
}

}  // namespace
}  // namespace osteon::sound
