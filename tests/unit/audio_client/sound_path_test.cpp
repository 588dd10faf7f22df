// One source and a listener, by closed forms: level, delay, pitch and sides.
#include "audio_client/space/sound_path.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "audio_client/space/sofa_file.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/tones.hpp"
#include "tests/unit/audio_client/ideal_head.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::audio {
namespace {

using test::kPi;
using test::kRate_hz;

// A head at the origin that looks along x, with z up.
Space space_of(
    Listening listening, const test::EarLevel& level = [](double) { return 1.0; }) {
  Space space;
  space.listening = listening;
  if (listening == Listening::headphones)
    space.hrtf = std::make_shared<const Hrtf>(*Hrtf::make(test::sphere(level), kRate_hz));
  return space;
}

struct Heard {
  std::vector<float> left, right;
};

// What is heard of `source` while the tool is at `place`, by the time in seconds.
Heard hear(const Space& space, const std::function<float(std::size_t)>& source,
           const std::function<Vec3(double)>& place, double seconds) {
  SoundPath path;
  path.prepare(space, kRate_hz);
  path.start(place(0));
  Heard heard;
  const auto blocks = static_cast<std::size_t>(seconds * kRate_hz / kBlockFrames);
  for (std::size_t b = 0; b < blocks; ++b) {
    Block in;
    for (std::size_t i = 0; i < in.size(); ++i) in[i] = source(b * kBlockFrames + i);
    path.aim(place(static_cast<double>((b + 1) * kBlockFrames) / kRate_hz));
    StereoBlock out;
    path.add_to(in, out);
    heard.left.insert(heard.left.end(), out.left.begin(), out.left.end());
    heard.right.insert(heard.right.end(), out.right.begin(), out.right.end());
  }
  return heard;
}

std::function<float(std::size_t)> tone(double hz, double amplitude = 1) {
  return [=](std::size_t n) {
    return static_cast<float>(amplitude * std::sin(2 * kPi * hz * static_cast<double>(n) / kRate_hz));
  };
}

std::function<Vec3(double)> still(const Vec3& at_mm) {
  return [=](double) { return at_mm; };
}

Vec3 round_head(double degrees, double distance_mm) {
  return distance_mm * Vec3(std::cos(degrees * kPi / 180), std::sin(degrees * kPi / 180), 0);
}

float impulse(std::size_t n) { return n == 0 ? 1.0F : 0.0F; }

double rms(std::span<const float> samples) { return std::pow(10, sound::rms_db(samples.subspan(4800)) / 20); }

class BothWays : public testing::TestWithParam<Listening> {};
INSTANTIATE_TEST_SUITE_P(Listening, BothWays, testing::Values(Listening::loudspeakers, Listening::headphones));

// Pressure falls as 1 / distance: 6.02 dB for each doubling. At the reference distance the source has its own level.
TEST_P(BothWays, LevelFallsBySixDecibelsWithEachDoubling) {
  const Space space = space_of(GetParam());
  const double own_db = 20 * std::log10(std::numbers::sqrt2 / 2);
  for (const double times : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    const Vec3 at_mm = round_head(0, times * reference_mm(GetParam()));
    const Heard heard = hear(space, tone(1000), still(at_mm), 0.3);
    EXPECT_NEAR(20 * std::log10(rms(heard.left)), own_db - 20 * std::log10(times), 0.05) << times;
    EXPECT_NEAR(rms(heard.left), rms(heard.right), 1e-4) << "from ahead";
  }
  // Near the listener the level is bounded, and far away too.
  const auto level = [&](double distance_mm) {
    return rms(hear(space, tone(1000), still(round_head(0, distance_mm)), 0.3).left);
  };
  EXPECT_NEAR(level(1), level(0.25 * reference_mm(GetParam())), 1e-4);
  EXPECT_NEAR(level(5e4), level(kFarthest_mm), 1e-6);
}

// Distances of whole frames: the impulse stays one, and arrives at distance / speed of sound.
TEST_P(BothWays, ArrivesAfterTheDistanceOverTheSpeedOfSound) {
  const Space space = space_of(GetParam());
  for (const int frames : {40, 64, 200, 650}) {
    const double distance_mm = frames * kSoundSpeed_mm_per_s / kRate_hz;
    const Heard heard = hear(space, impulse, still(round_head(0, distance_mm)), 0.03);
    const auto loudest = std::ranges::max_element(heard.left) - heard.left.begin();
    EXPECT_EQ(loudest, frames);
    for (int i = 0; i < frames; ++i) ASSERT_LT(std::abs(heard.left[static_cast<std::size_t>(i)]), 0.05) << i;
    if (GetParam() == Listening::loudspeakers) {
      EXPECT_NEAR(heard.left[static_cast<std::size_t>(frames)], reference_mm(GetParam()) / distance_mm, 1e-5);
    }
  }
}

// Also where it lies between frames: the phase of a tone tells the delay.
TEST_P(BothWays, DelaysBetweenFramesAreHeardInThePhase) {
  const Space space = space_of(GetParam());
  for (const double distance_mm : {300.0, 301.5, 303.0, 304.5}) {
    const Heard heard = hear(space, tone(1000), still(round_head(0, distance_mm)), 0.3);
    double re = 0, im = 0;  // over whole periods
    for (std::size_t n = 4800; n < 9600; ++n) {
      const double angle = 2 * kPi * 1000 * (static_cast<double>(n) / kRate_hz - distance_mm / kSoundSpeed_mm_per_s);
      re += heard.left[n] * std::sin(angle);
      im += heard.left[n] * std::cos(angle);
    }
    // 1 us is a third of a millimetre. The filter of an ideal head ends at 22.5 kHz, and its minimum phase has 1.3 us.
    const double most_s = GetParam() == Listening::headphones ? 3e-6 : 0.3e-6;
    EXPECT_NEAR(std::atan2(im, re) / (2 * kPi * 1000), 0, most_s) << distance_mm;
  }
}

// A source that comes nearer at v sounds at f c / (c - v), exactly. f (1 + v / c) would be 8.5e-4 less at 10 m/s.
TEST_P(BothWays, MovingSourcesHaveDopplersPitch) {
  const Space space = space_of(GetParam());
  struct Motion {
    double speed_mm_per_s, from_mm;
  };
  for (const Motion& motion : {Motion{10'000, 4800}, Motion{3'000, 2000}, Motion{-3'000, 600}, Motion{-10'000, 600}}) {
    const auto place = [&](double t) { return round_head(0, motion.from_mm - motion.speed_mm_per_s * t); };
    const Heard heard = hear(space, tone(1000), place, 0.4);
    // Beyond the time that the followed position needs to have the source's speed.
    const std::span<const float> steady = std::span(heard.left).subspan(9600);
    const double wanted_hz = 1000 * kSoundSpeed_mm_per_s / (kSoundSpeed_mm_per_s - motion.speed_mm_per_s);
    EXPECT_NEAR(sound::find_tone(steady, kRate_hz, wanted_hz - 15, wanted_hz + 15).hz / wanted_hz, 1, 5e-5)
        << motion.speed_mm_per_s;
  }
}

// A haptic client sends up to 60 states a second, and a recorded session may have more. The steps between them must not
// be heard as a wobble: of a tone that moves at 0.5 m/s, sidebands at the rate of the states stay 40 dB below it.
TEST_P(BothWays, StepsBetweenStatesMakeNoSidebands) {
  const double line_hz = 4000 * kSoundSpeed_mm_per_s / (kSoundSpeed_mm_per_s - 500);
  for (const double states_hz : {60.0, 120.0}) {
    const auto place = [=](double t) { return round_head(0, 800 - 500 * std::floor(t * states_hz) / states_hz); };
    const Heard heard = hear(space_of(GetParam()), tone(4000), place, 0.9);
    const std::span<const float> steady = std::span(heard.left).subspan(14400);
    const double line_db = sound::tone_db(steady, kRate_hz, line_hz);
    for (const double side_hz : {-states_hz, states_hz})
      EXPECT_LT(sound::tone_db(steady, kRate_hz, line_hz + side_hz), line_db - 40) << side_hz;
  }
}

TEST_P(BothWays, AMirroredSourceIsHeardWithTheSidesExchanged) {
  const Space space = space_of(GetParam(), [](double along) { return 0.55 + 0.45 * along; });
  for (const double degrees : {0.0, 17.0, 90.0, 133.0}) {
    const Heard here = hear(space, tone(1500), still(round_head(degrees, 600)), 0.2);
    const Heard there = hear(space, tone(1500), still(round_head(-degrees, 600)), 0.2);
    for (std::size_t n = 0; n < here.left.size(); ++n) {
      ASSERT_NEAR(here.left[n], there.right[n], 2e-4) << degrees << " " << n;
      ASSERT_NEAR(here.right[n], there.left[n], 2e-4) << degrees << " " << n;
    }
    if (degrees > 0) {
      EXPECT_GT(rms(here.left), rms(here.right)) << "y is left";
    }
  }
}

// A source that jumps across the head in one block: its delay changes by up to Woodworth's d = 2 a / c (pi / 4 + 1 /
// 2), so for a block the tone has a frequency of at most w (1 + d rate / 64); its level moves by at most 1 in 64
// frames, and so do the filters. The second difference of g x is at most g x'' + 2 g' x', and at the ends of the block
// the slopes of g and of the phase jump once. A filter that was exchanged at once would add a step of 0.9 of the
// amplitude.
TEST_P(BothWays, ASourceThatJumpsMakesNoStep) {
  constexpr double kTone_hz = 300;
  Space space = space_of(GetParam(), [](double along) { return 0.55 + 0.45 * along; });
  space.smoothing_s = 0;
  const double distance_mm = reference_mm(GetParam());
  const auto place = [&](double t) { return round_head(static_cast<int>(t / 0.05) % 2 == 0 ? 90 : -90, distance_mm); };
  const Heard heard = hear(space, tone(kTone_hz), place, 0.5);
  const bool ears = GetParam() == Listening::headphones;
  const double w = 2 * kPi * kTone_hz / kRate_hz;
  const double delay = test::woodworth_delay_s(-1) - test::woodworth_delay_s(1);
  const double faster = ears ? delay * kRate_hz / kBlockFrames : 0;
  const double most = ears ? 1 / 0.55 : std::numbers::sqrt2;  // the largest amplitude
  const double slope = most / kBlockFrames, fast = w * (1 + faster);
  const double bound = most * fast * fast + 2 * slope * fast + slope + most * w * faster;
  double largest = 0;
  for (std::size_t n = 2; n + 1 < heard.left.size(); ++n) {
    if (n < 400) continue;  // the tone begins
    for (const std::vector<float>* side : {&heard.left, &heard.right})
      largest = std::max<double>(largest, std::abs((*side)[n + 1] - 2 * (*side)[n] + (*side)[n - 1]));
  }
  EXPECT_LT(largest, bound);
  EXPECT_LT(bound, 0.2) << "a step would be seen";
}

TEST(Loudspeakers, BothTogetherHaveOnePowerAtAllAngles) {
  const Space space = space_of(Listening::loudspeakers);
  const double ahead = rms(hear(space, tone(1000), still(round_head(0, 300)), 0.3).left);
  for (int degrees = 0; degrees < 360; degrees += 15) {
    const Heard heard = hear(space, tone(1000), still(round_head(degrees, 300)), 0.3);
    EXPECT_NEAR(std::hypot(rms(heard.left), rms(heard.right)), std::numbers::sqrt2 * ahead, 1e-4) << degrees;
  }
  const Heard left = hear(space, tone(1000), still(round_head(90, 300)), 0.3);
  EXPECT_LT(rms(left.right), 1e-6) << "from the side, one is silent";
}

// The ears of an ideal head get the tone at Woodworth's times.
TEST(Headphones, TheFarEarHearsLaterByWoodworth) {
  const Space space = space_of(Listening::headphones);
  for (const double degrees : {30.0, 60.0, 90.0, 120.0}) {
    const Heard heard = hear(space, tone(500), still(round_head(degrees, 700)), 0.3);
    double re = 0, im = 0;  // of right over left, over whole periods
    const auto part = [&](const std::vector<float>& side, bool sine) {
      double sum = 0;
      for (std::size_t n = 4800; n < 9600; ++n) {
        const double angle = 2 * kPi * 500 * static_cast<double>(n) / kRate_hz;
        sum += side[n] * (sine ? std::sin(angle) : std::cos(angle));
      }
      return sum;
    };
    const double ls = part(heard.left, true), lc = part(heard.left, false), rs = part(heard.right, true),
                 rc = part(heard.right, false);
    re = ls * rs + lc * rc;
    im = lc * rs - ls * rc;
    const double along = std::sin(degrees * kPi / 180);
    const double wanted_s = test::woodworth_delay_s(-along) - test::woodworth_delay_s(along);
    EXPECT_NEAR(std::atan2(im, re) / (2 * kPi * 500), wanted_s, 5e-6) << degrees;
  }
}

TEST(Headphones, AHeadOfAFileIsHeard) {
  Space space;
  space.listening = Listening::headphones;
  const auto hrtf = read_hrtf({}, kRate_hz);
  ASSERT_TRUE(hrtf) << hrtf.error().message;
  space.hrtf = std::make_shared<const Hrtf>(*hrtf);
  const Heard left = hear(space, tone(4000), still(round_head(90, 500)), 0.2);
  const Heard behind = hear(space, tone(4000), still(round_head(180, 500)), 0.2);
  EXPECT_GT(rms(left.left), 2 * rms(left.right));
  EXPECT_NEAR(rms(behind.left), rms(behind.right), 1e-3 * rms(behind.left));
}

TEST(Mono, IsTheSourceItself) {
  const Heard heard = hear(space_of(Listening::mono), tone(700), still(round_head(70, 900)), 0.05);
  for (std::size_t n = 0; n < heard.left.size(); ++n) {
    ASSERT_EQ(heard.left[n], tone(700)(n));
    ASSERT_EQ(heard.right[n], heard.left[n]);
  }
}

TEST_P(BothWays, EndsInSilenceWhenAllHasArrived) {
  SoundPath path;
  path.prepare(space_of(GetParam()), kRate_hz);
  EXPECT_FALSE(path.ringing());
  path.start(round_head(20, 3000));
  Block in;
  in.fill(1.0F);
  StereoBlock out;
  path.add_to(in, out);
  EXPECT_TRUE(path.ringing());
  in.fill(0.0F);
  int blocks = 0;
  for (; path.ringing(); ++blocks) {
    ASSERT_LT(blocks, 50);
    path.add_to(in, out);
  }
  EXPECT_GT(blocks * kBlockFrames, 3000 / kSoundSpeed_mm_per_s * kRate_hz);
  out = StereoBlock{};
  path.add_to(in, out);
  EXPECT_EQ(sound::peak(out.left), 0);
  EXPECT_EQ(sound::peak(out.right), 0);
}

TEST_P(BothWays, ImpossiblePositionsAndSpeedsStayBounded) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const std::vector<Vec3> places{{0, 0, 0},   {nan, 0, 0},  {1e300, 0, 0}, {0, -inf, 0},
                                 {0, 0, 1e6}, {1e-9, 0, 0}, {-5000, 0, 0}};
  const auto place = [&](double t) { return places[static_cast<std::size_t>(t * 400) % places.size()]; };
  const Heard heard = hear(space_of(GetParam()), tone(2000), place, 0.2);
  // 12 dB for what is near, and 3 dB for what is all at one side.
  for (const std::vector<float>* side : {&heard.left, &heard.right})
    for (const float x : *side) ASSERT_LT(std::abs(x), 4 * std::numbers::sqrt2 * 1.3);
}

}  // namespace
}  // namespace osteon::audio
