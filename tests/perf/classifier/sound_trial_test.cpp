// The trial of the sounds, on numbers whose answer is known.
#include "tests/perf/classifier/sound_trial.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/sound/drilling_states.hpp"
#include "common/sound/random.hpp"
#include "common/sound/resample.hpp"
#include "tests/perf/classifier/gaussian_hmm.hpp"

namespace osteon::test {
namespace {

double gaussian(sound::Random& random) {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - random.unit()));
  return radius * std::cos(2.0 * std::numbers::pi * random.unit());
}

// Frames of two classes with unit variance, `apart` standard deviations from each other.
LabelledFrames two_classes(int count, double apart, double stays, sound::Random& random) {
  LabelledFrames frames;
  frames.rows.resize(count, 1);
  int now = 0;
  for (int i = 0; i < count; ++i) {
    if (random.unit() > stays) now = 1 - now;
    frames.classes.push_back(now);
    frames.rows(i, 0) = apart * now + gaussian(random);
  }
  return frames;
}

double share_right(const std::vector<int>& truth, const std::vector<int>& named) {
  int right = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) right += truth[i] == named[i];
  return right / static_cast<double>(truth.size());
}

// Without memory no classifier is better than the threshold in the middle, whose error is Q(d / 2).
TEST(GaussianHmm, ReachesTheBestThresholdOfTwoGaussians) {
  sound::Random random(5);
  constexpr int kFrames = 40000;
  constexpr double kApart = 2.0;
  const LabelledFrames lesson = two_classes(kFrames, kApart, 0.5, random);
  const LabelledFrames exam = two_classes(kFrames, kApart, 0.5, random);
  const GaussianHmm model = GaussianHmm::learned({lesson}, 2, {.share = 0.0, .weight = 1.0});
  const double best = 1.0 - 0.5 * std::erfc(0.5 * kApart / std::numbers::sqrt2);
  const double sigma = std::sqrt(best * (1 - best) / kFrames);
  EXPECT_NEAR(share_right(exam.classes, model.named(exam.rows)), best, 4 * sigma);
}

TEST(GaussianHmm, MemoryHelpsWhereClassesLast) {
  sound::Random random(6);
  const LabelledFrames lesson = two_classes(20000, 2.0, 0.98, random), exam = two_classes(20000, 2.0, 0.98, random);
  const GaussianHmm model = GaussianHmm::learned({lesson}, 2, {.share = 0.0, .weight = 1.0});
  const double threshold = 1.0 - 0.5 * std::erfc(1.0 / std::numbers::sqrt2);
  EXPECT_GT(share_right(exam.classes, model.named(exam.rows)), 0.5 * (1 + threshold));
}

// The point is a cone of 118 degrees. Half of its area is beyond a surface when the tip is h / sqrt(2) beyond it.
TEST(DrilledLayers, LabelsFollowTheCone) {
  Drilling drilling;
  drilling.shell = {.near_mm = 3, .between_mm = 10, .far_mm = 2.5};
  const DrilledLayers layers = drill(drilling);
  const double height_mm = 1.6 / std::tan(59 * std::numbers::pi / 180);
  const auto depth_at = [&](std::size_t tick) {  // of the tip; states are 8.3 ms apart
    const auto state = static_cast<std::size_t>(std::lround(static_cast<double>(tick) * 0.12));
    return -layers.states.at(state).pose_bone_tool.position_mm.z();
  };
  std::vector<std::pair<SoundClass, std::size_t>> parts;
  for (std::size_t i = 0; i < layers.truth.size(); ++i)
    if (parts.empty() || parts.back().first != layers.truth[i]) parts.emplace_back(layers.truth[i], i);
  using enum SoundClass;
  std::vector<SoundClass> order;
  for (const auto& [one, tick] : parts) order.push_back(one);
  ASSERT_EQ(order, (std::vector<SoundClass>{silent, free, cortical, cancellous, cortical, perforation, free, silent}));
  const double half_mm = height_mm / std::numbers::sqrt2;
  // A state is at most 1/120 s away, in which a drill moves 0.1 mm in cancellous bone.
  EXPECT_NEAR(depth_at(parts[2].second), height_mm * std::sqrt(0.1), 0.1);
  EXPECT_NEAR(depth_at(parts[3].second), 3 + half_mm, 0.1);
  EXPECT_NEAR(depth_at(parts[4].second), 13 + half_mm, 0.1);
  EXPECT_NEAR(depth_at(parts[5].second), 15.5 + half_mm, 0.4);  // it plunges
}

// T = 134.6 N^-0.3327 v^0.5189 rho^1.1841 (7.3): the hand's 27 N at 1000 rpm give the feed, and the feed the time.
TEST(DrilledLayers, AHandFeedsByChisLaw) {
  Drilling drilling;
  const DrilledLayers layers = drill(drilling);
  const double feed = std::pow(27 / (134.6 * std::pow(1000.0, -0.3327) * std::pow(1.9, 1.1841)), 1 / 0.5189);
  double found = 0;
  for (const CuttingState& state : layers.states)
    if (state.engaged_fraction > 0.999 && state.density_g_cm3 > 1.899) found = state.feed_mm_per_s;
  EXPECT_NEAR(found, feed, 0.05 * feed);  // the spindle droops, and a slower one resists more
}

std::vector<float> hiss(std::size_t count) {
  sound::Random random(3);
  std::vector<float> samples(count);
  for (float& x : samples) x = static_cast<float>(0.1 * gaussian(random));
  return samples;
}

TEST(SoundFeatures, AnEqualLevelHidesTheLevel) {
  const std::vector<float> quiet = hiss(24000);
  std::vector<float> loud = quiet;
  for (float& x : loud) x *= 4;
  EXPECT_LT((features(loud, Hearing::equal_rms) - features(quiet, Hearing::equal_rms)).cwiseAbs().maxCoeff(), 1e-3);
  const Eigen::MatrixXd rise = features(loud, Hearing::level_only) - features(quiet, Hearing::level_only);
  EXPECT_LT((rise.array() - 20 * std::log10(4.0)).abs().maxCoeff(), 1e-3);
}

TEST(SoundFeatures, NoiseHasThePowerThatIsAsked) {
  std::vector<float> tone(96000);
  for (std::size_t i = 0; i < tone.size(); ++i)
    tone[i] = i < 48000 ? 0.0F : static_cast<float>(std::sin(0.1 * static_cast<double>(i)));
  const std::vector<float> noisy = with_noise(tone, 1.0, 2.0, 6.0, 1);
  double noise = 0;
  for (std::size_t i = 0; i < tone.size(); ++i) noise += std::pow(noisy[i] - tone[i], 2) / 96000;
  EXPECT_NEAR(10 * std::log10(0.5 / noise), 6.0, 0.1);
}

constexpr int kAnalysed_hz = 22050;  // of "osteon-audio analyse" (8.5.4)

// "osteon-audio analyse" knows nothing of these drillings. It finds the one breakthrough of each, through two layers
// with soft bone between them and through one alone, at the speeds of a hand-held drill.
TEST(SoundTrial, TheAnalysisFindsEachBreakthroughOnce) {
  for (const double rpm : {800.0, 1000.0, 1400.0}) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      Drilling usual;
      usual.rpm = rpm;
      Drilling drilling = varied(usual, 5000 + seed);
      if (seed % 3 == 0) drilling.shell = {.near_mm = 2, .between_mm = 0, .far_mm = 2.5};
      const Sounding sound = sounding(drilling, seed);
      const auto through = std::ranges::find(sound.classes, static_cast<int>(SoundClass::perforation));
      ASSERT_NE(through, sound.classes.end());
      const double at_s = kFrameStep_s * static_cast<double>(through - sound.classes.begin());
      const std::vector<float> analysed = sound::resampled(sound.samples, 48000, kAnalysed_hz);
      int found = 0;
      for (const sound::StateSpan& span : sound::drilling_states(analysed, kAnalysed_hz, {.spindle_rpm = rpm})) {
        if (span.state != sound::DrillingState::perforation) continue;
        ++found;
        EXPECT_NEAR(span.from_s, at_s, 0.1);
      }
      EXPECT_EQ(found, 1) << rpm << " rpm, seed " << seed << ", through at " << at_s << " s";
    }
  }
}

TEST(SoundTrial, CountsWhatIsRight) {
  Confusion confusion{};
  confusion[0][0] = 90;
  confusion[1][1] = 5;
  confusion[1][0] = 5;
  EXPECT_DOUBLE_EQ(accuracy(confusion), 0.95);
  EXPECT_DOUBLE_EQ(mean_recall(confusion), (1.0 + 0.5) / 5);
}

}  // namespace
}  // namespace osteon::test
