// Peaks, their continuation, and their sound against tones whose parameters are known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/sound/likeness.hpp"
#include "common/sound/oscillator.hpp"
#include "common/sound/partials.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::sound {
namespace {

using std::numbers::pi;

double db(double amplitude) { return 20.0 * std::log10(amplitude); }

// amplitude cos(2 pi hz t + phase), t = 0 at sample `zero`.
std::vector<float> cosine_wave(double hz, double amplitude, double phase, std::size_t count, double zero) {
  std::vector<float> samples(count);
  for (std::size_t i = 0; i < count; ++i)
    samples[i] = static_cast<float>(amplitude *
                                    std::cos(2.0 * pi * hz * (static_cast<double>(i) - zero) / kAnalysed_hz + phase));
  return samples;
}

const Sinusoid& nearest(const std::vector<Sinusoid>& peaks, double hz) {
  return *std::ranges::min_element(peaks, {}, [&](const Sinusoid& p) { return std::abs(p.hz - hz); });
}

TEST(SpectralPeaks, OnePartialIsItsFrequencyAmplitudeAndPhase) {
  for (const int refinements : {0, 2}) {
    PeakFinder finder(1000, kAnalysed_hz, {.refinements = refinements});
    for (const double hz : {150.0, 440.3, 1003.7, 2280.0, 6840.9, 9999.1})
      for (const double phase : {-2.0, 0.0, 1.0}) {
        const std::vector<Sinusoid> peaks = finder.find(cosine_wave(hz, 0.3, phase, 1000, 500));
        ASSERT_FALSE(peaks.empty());
        const Sinusoid& peak = *std::ranges::max_element(peaks, {}, &Sinusoid::amplitude);
        EXPECT_NEAR(peak.hz, hz, 0.5) << refinements;
        EXPECT_NEAR(db(peak.amplitude), db(0.3), 0.05) << hz;
        EXPECT_NEAR(std::remainder(peak.phase - phase, 2.0 * pi), 0.0, 0.03) << hz;
      }
  }
}

TEST(SpectralPeaks, RefinementSeparatesTwoClosePartials) {
  // Their main lobes, 88 Hz wide on either side of the top, overlap.
  const auto error = [](int refinements) {
    PeakFinder finder(1000, kAnalysed_hz, {.refinements = refinements});
    double worst_hz = 0, worst_db = 0;
    for (const double phase : {0.0, 0.8, 1.6, 2.4, 3.0}) {
      const std::vector<float> both =
          added(cosine_wave(1000.0, 0.2, 0.3, 1000, 500), cosine_wave(1100.0, 0.1, phase, 1000, 500));
      const std::vector<Sinusoid> peaks = finder.find(both);
      for (const auto& [hz, amplitude] : {std::pair{1000.0, 0.2}, std::pair{1100.0, 0.1}}) {
        const Sinusoid& peak = nearest(peaks, hz);
        worst_hz = std::max(worst_hz, std::abs(peak.hz - hz));
        worst_db = std::max(worst_db, std::abs(db(peak.amplitude) - db(amplitude)));
      }
    }
    return std::pair(worst_hz, worst_db);
  };
  const auto [hz, level_db] = error(8);
  EXPECT_LT(hz, 0.5);
  EXPECT_LT(level_db, 0.2);
  EXPECT_GT(error(0).first, 2.0 * hz);
}

TEST(SpectralPeaks, SideLobesAreNone) {
  // Those of a tone are 31 dB below it and less.
  for (const double hz : {300.0, 2011.0, 5555.5}) {
    EXPECT_EQ(PeakFinder(1000, kAnalysed_hz, {}).find(cosine_wave(hz, 0.5, 0.7, 1000, 500)).size(), 1U) << hz;
    // A tone that is louder than the side lobes is found among them.
    const std::vector<float> both =
        added(cosine_wave(hz, 0.5, 0.7, 1000, 500), cosine_wave(hz + 200, 0.5 * 0.02, 0, 1000, 500));
    EXPECT_EQ(PeakFinder(1000, kAnalysed_hz, {}).find(both).size(), 2U) << hz;
  }
}

TEST(SpectralPeaks, AreTheLoudestAboveTheThreshold) {
  std::vector<float> sum(1000, 0.0F);
  for (int i = 1; i <= 5; ++i) sum = added(sum, cosine_wave(1000.0 * i, std::pow(10.0, -i), 0, 1000, 500));
  const std::vector<Sinusoid> three = PeakFinder(1000, kAnalysed_hz, {.most = 3}).find(sum);
  ASSERT_EQ(three.size(), 3U);
  EXPECT_NEAR(three.back().hz, 3000, 1);
  const std::vector<Sinusoid> loud = PeakFinder(1000, kAnalysed_hz, {.threshold_db = -50.0}).find(sum);
  ASSERT_EQ(loud.size(), 2U);
  EXPECT_NEAR(loud.back().hz, 2000, 1);
  EXPECT_TRUE(PeakFinder(1000, kAnalysed_hz, {}).find(std::vector<float>(1000, 0.0F)).empty());
}

std::vector<Partial> partials_in(const std::vector<float>& samples, double threshold_db = -60.0) {
  const PartialParams params{.peaks = {.threshold_db = threshold_db}};
  return continued(frame_peaks(samples, kAnalysed_hz, params), kAnalysed_hz, params);
}

TEST(Partials, AToneIsOnePartialAndSoundsAsBefore) {
  const std::vector<float> samples = tone(1234.5, 0.4, 22050, kAnalysed_hz);
  const std::vector<Partial> partials = partials_in(samples);
  ASSERT_EQ(partials.size(), 1U);
  EXPECT_EQ(partials[0].first, 0U);
  EXPECT_EQ(partials[0].points.size(), 22050U / 128 + 1);
  for (const Sinusoid& point : partials[0].points) {
    EXPECT_NEAR(point.hz, 1234.5, 0.5);
    EXPECT_NEAR(db(point.amplitude), db(0.4), 0.2);
  }
  // After the last frame, 34 samples before the end, it fades: by i / 128 after i samples, which is 0.8 samples' power.
  EXPECT_GT(snr_db(samples, sound_with_phases(partials, kAnalysed_hz, 128, samples.size())), 43.0);
}

TEST(Partials, AChirpIsFollowed) {
  // 1000 to 3000 Hz in two seconds: 5.8 Hz in a hop.
  std::vector<float> samples(44100);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double t = static_cast<double>(i) / kAnalysed_hz;
    samples[i] = static_cast<float>(0.3 * std::cos(2.0 * pi * (1000.0 * t + 500.0 * t * t)));
  }
  const std::vector<Partial> partials = partials_in(samples);
  ASSERT_EQ(partials.size(), 1U);
  // Frames at the ends are moved to the side.
  for (std::size_t m = 4; m + 5 < partials[0].points.size(); ++m)
    EXPECT_NEAR(partials[0].points[m].hz, 1000.0 + 1000.0 * static_cast<double>(m) * 128 / kAnalysed_hz, 0.5) << m;
  // A frame's phase is the mean over its window, whose variance is T^2 (1/12 - 1/(2 pi^2)). So it leads by pi r times
  // that, where r is 1000 Hz/s, and the difference of the sounds is 2 sin(lead / 2) of the chirp.
  const double window_s = 1000 / kAnalysed_hz;
  const double lead = pi * 1000.0 * window_s * window_s * (1.0 / 12.0 - 1.0 / (2.0 * pi * pi));
  EXPECT_NEAR(snr_db(samples, sound_with_phases(partials, kAnalysed_hz, 128, samples.size())),
              -db(2.0 * std::sin(0.5 * lead)), 0.7);
}

TEST(Partials, AModulatedAmplitudeIsFollowed) {
  // A frame sees its mean under the window: modulation at f is reduced by sinc(x) / (1 - x^2), x = f window / rate.
  const double hz = 5.0, depth = 0.5, x = hz * 1000 / kAnalysed_hz;
  const double seen = depth * std::sin(pi * x) / (pi * x) / (1.0 - x * x);
  std::vector<float> samples = tone(2000, 0.3, 44100, kAnalysed_hz);
  const auto modulation = [&](double by, std::size_t i) {
    return 1.0 + by * std::cos(2.0 * pi * hz * static_cast<double>(i) / kAnalysed_hz);
  };
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] *= static_cast<float>(modulation(depth, i));
  const std::vector<Partial> partials = partials_in(samples);
  ASSERT_EQ(partials.size(), 1U);
  for (std::size_t m = 4; m + 5 < partials[0].points.size(); ++m)
    EXPECT_NEAR(db(partials[0].points[m].amplitude), db(0.3 * modulation(seen, m * 128)), 0.1) << m;
}

TEST(Partials, ATonesBeginningAndEndAreThoseOfItsPartial) {
  std::vector<float> samples(44100, 0.0F);
  const std::vector<float> sounding = tone(3000, 0.3, 44100, kAnalysed_hz);
  std::copy(sounding.begin() + 11025, sounding.begin() + 33075, samples.begin() + 11025);
  const std::vector<Partial> partials = partials_in(samples, -30.0);
  const auto longest =
      std::ranges::max_element(partials, {}, [](const Partial& partial) { return partial.points.size(); });
  ASSERT_NE(longest, partials.end());
  EXPECT_NEAR(static_cast<double>(longest->first), 11025.0 / 128, 4);
  EXPECT_NEAR(static_cast<double>(longest->first + longest->points.size()), 33075.0 / 128, 4);
}

TEST(Partials, BeforeACutNothingIsSeenOfWhatFollows) {
  // A tone, and at once another one.
  std::vector<float> samples = tone(1000, 0.3, 22050, kAnalysed_hz);
  const std::vector<float> other = tone(3000, 0.3, 22050, kAnalysed_hz);
  std::copy(other.begin() + 10000, other.end(), samples.begin() + 10000);
  const PartialParams params{.peaks = {.threshold_db = -60.0}};
  const std::vector<std::size_t> cuts{10000};
  const auto frames = frame_peaks(samples, kAnalysed_hz, params, cuts);
  for (std::size_t m = 0; m * 128 < 10000; ++m) {
    ASSERT_EQ(frames[m].size(), 1U) << m;
    const Sinusoid& peak = frames[m].front();
    EXPECT_NEAR(peak.hz, 1000, 0.5) << m;
    EXPECT_NEAR(db(peak.amplitude), db(0.3), 0.1) << m;
    // The phase is that of the frame's own middle: a sine is a cosine a quarter turn later.
    const double expected = 2.0 * pi * 1000.0 * static_cast<double>(m) * 128 / kAnalysed_hz - 0.5 * pi;
    EXPECT_NEAR(std::remainder(peak.phase - expected, 2.0 * pi), 0.0, 0.05) << m;
  }
  EXPECT_GT(frame_peaks(samples, kAnalysed_hz, params)[10000 / 128 - 1].size(), 1U);
}

std::vector<Sinusoid> at(std::initializer_list<double> hz) {
  std::vector<Sinusoid> peaks;
  for (const double f : hz) peaks.push_back({.hz = f, .amplitude = 0.1});
  return peaks;
}

TEST(Continuation, TheClosestPairComesFirst) {
  // 1012 is nearest to 1010, which takes it. So 1000 takes 990, and 2000, which has nothing within 30 Hz, dies.
  const std::vector<std::vector<Sinusoid>> frames{at({1000, 1010, 2000}), at({990, 1012, 2040})};
  const std::vector<Partial> partials = continued(frames, kAnalysed_hz, {.peaks = {}, .shortest_s = 0});
  ASSERT_EQ(partials.size(), 4U);
  EXPECT_EQ(partials[0].points.back().hz, 990);
  EXPECT_EQ(partials[1].points.back().hz, 1012);
  EXPECT_EQ(partials[2].points.size(), 1U);
  EXPECT_EQ(partials[3].first, 1U);
  EXPECT_EQ(partials[3].points.front().hz, 2040);
}

TEST(Continuation, APeakBelongsToOnePartial) {
  const std::vector<std::vector<Sinusoid>> frames{at({1000, 1010}), at({1008})};
  const std::vector<Partial> partials = continued(frames, kAnalysed_hz, {.peaks = {}, .shortest_s = 0});
  ASSERT_EQ(partials.size(), 2U);
  EXPECT_EQ(partials[0].points.size(), 1U);
  EXPECT_EQ(partials[1].points.size(), 2U);
}

TEST(Continuation, ShortPartialsAreLeftOut) {
  // 0.02 s are 3.4 hops.
  std::vector<std::vector<Sinusoid>> frames{at({1000, 3000}), at({1000, 3000}), at({1000, 3000}), at({1000}), {}};
  const std::vector<Partial> partials = continued(frames, kAnalysed_hz, {});
  ASSERT_EQ(partials.size(), 1U);
  EXPECT_EQ(partials[0].points.size(), 4U);
}

TEST(Oscillator, CosineIsThatOfTheLibrary) {
  for (double turns = -3.0; turns <= 3.0; turns += 1.0 / 1024 / 3)
    EXPECT_NEAR(cosine(turns), std::cos(2.0 * pi * turns), 1e-6) << turns;
  EXPECT_NEAR(cosine(1e6 + 0.25), 0.0, 1e-6);
}

TEST(Oscillator, TheCubicOfAChirpIsTheChirp) {
  // The phase of a chirp is a square. It is among the cubics, and the smoothest of those that meet both ends.
  const auto turns = [](double i) { return 0.1 + 0.05 * i + 2e-5 * i * i; };
  const auto point = [&](double i) {
    return Sinusoid{.hz = (0.05 + 4e-5 * i) * kAnalysed_hz,
                    .amplitude = 0.2 + 0.001 * i,
                    .phase = std::remainder(2.0 * pi * turns(i), 2.0 * pi)};
  };
  std::vector<float> sound(200, 0.0F);
  add_cubic(sound, -28, 128, point(0), point(128), kAnalysed_hz);
  for (int i = 28; i < 128; ++i)
    EXPECT_NEAR(sound[static_cast<std::size_t>(i - 28)], (0.2 + 0.001 * i) * std::cos(2.0 * pi * turns(i)), 2e-5) << i;
  for (std::size_t i = 100; i < sound.size(); ++i) EXPECT_EQ(sound[i], 0.0F);
}

TEST(Oscillator, ALineOfFrequencyCarriesItsPhaseOn) {
  std::vector<float> sound(256, 0.0F);
  const Sinusoid a{.hz = 1000, .amplitude = 0.5}, b{.hz = 1200, .amplitude = 0.5};
  const double turns = add_linear(sound, 0, 128, a, b, 0.25, kAnalysed_hz);
  // The mean frequency over 128 samples.
  const double expected = 0.25 + 1100.0 * 128 / kAnalysed_hz;
  EXPECT_NEAR(turns, expected - std::floor(expected), 1e-9);
  add_linear(sound, 128, 128, b, b, turns, kAnalysed_hz);
  EXPECT_NEAR(sound[128], 0.5 * std::cos(2.0 * pi * expected), 1e-5);
  EXPECT_NEAR(sound[0], 0.0, 1e-6);
}

}  // namespace
}  // namespace osteon::sound
