// The tools of a room for two ears: the mix, its silence, and that nothing is allocated meanwhile.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "audio_client/output/sound_engine.hpp"
#include "audio_client/space/sofa_file.hpp"
#include "audio_client/synth/drill_synth.hpp"
#include "common/sound/levels.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/unit/audio_client/ideal_head.hpp"
#include "tests/unit/audio_client/played_tools.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::audio {
namespace {

using test::kRate_hz;

Space usual_space(Listening way) {
  Space space;
  space.listening = way;
  space.pose_bone_head = looking(usual_listener_mm(way), Vec3::Zero(), -Vec3::UnitY());
  if (way == Listening::headphones)
    space.hrtf = std::make_shared<const Hrtf>(
        *Hrtf::make(test::sphere([](double along) { return 0.55 + 0.45 * along; }), kRate_hz));
  return space;
}

ToolSound tool_at(const Vec3& tip_mm, std::uint64_t author, const CuttingState& state) {
  ToolSound tool = tool_sound(state);
  tool.author = author;
  tool.tip_mm = tip_mm;
  return tool;
}

SoundScene scene(const std::vector<ToolSound>& tools) {
  SoundScene made;
  for (const ToolSound& tool : tools) made.tools[static_cast<std::size_t>(made.count++)] = tool;
  return made;
}

struct Sides {
  std::vector<float> left, right;
};

Sides played(DrillSynth& synth, const std::vector<ToolSound>& tools, double seconds) {
  Sides sides{std::vector<float>(static_cast<std::size_t>(seconds * kRate_hz)), {}};
  sides.right.resize(sides.left.size());
  synth.aim(scene(tools));
  // Pieces that are no whole blocks.
  for (std::size_t at = 0; at < sides.left.size(); at += 100) {
    const std::size_t count = std::min<std::size_t>(100, sides.left.size() - at);
    synth.process(std::span(sides.left).subspan(at, count), std::span(sides.right).subspan(at, count));
  }
  return sides;
}

SynthParams params_in(Listening way) {
  SynthParams params;
  params.rate_hz = kRate_hz;
  params.seed = 3;
  params.space = usual_space(way);
  return params;
}

DrillSynth synth_in(Listening way) {
  DrillSynth synth;
  synth.prepare(params_in(way));
  return synth;
}

class StereoSynth : public testing::TestWithParam<Listening> {};
INSTANTIATE_TEST_SUITE_P(Listening, StereoSynth,
                         testing::Values(Listening::mono, Listening::loudspeakers, Listening::headphones));

// Below the limiter's ceiling, two tools sound as the sum of each alone.
TEST_P(StereoSynth, TwoToolsAddUp) {
  const ToolSound one = tool_at({30, 0, 120}, 1, test::free_drill(1400));
  const ToolSound two = tool_at({-20, 10, -150}, 2, test::cancellous_drill(1380));
  DrillSynth a = synth_in(GetParam()), b = synth_in(GetParam()), both = synth_in(GetParam());
  const Sides alone = played(a, {one}, 0.6), other = played(b, {two}, 0.6), together = played(both, {one, two}, 0.6);
  ASSERT_LT(sound::peak(together.left), 0.9);
  ASSERT_LT(sound::peak(together.right), 0.9);
  EXPECT_GT(sound::peak(together.left), 0.02);
  for (std::size_t n = 0; n < together.left.size(); ++n) {
    ASSERT_NEAR(together.left[n], alone.left[n] + other.left[n], 1e-6) << n;
    ASSERT_NEAR(together.right[n], alone.right[n] + other.right[n], 1e-6) << n;
  }
}

TEST_P(StereoSynth, AToolIsHeardAtItsSide) {
  DrillSynth synth = synth_in(GetParam());
  const Sides sides = played(synth, {tool_at({0, 0, 200}, 1, test::cortical_drill(1345))}, 0.6);
  const double apart_db = sound::rms_db(sides.left) - sound::rms_db(sides.right);
  if (GetParam() == Listening::mono) {
    EXPECT_EQ(sides.left, sides.right);
  } else {
    EXPECT_GT(apart_db, 3) << "the patient's head is at the usual listener's left";
  }
}

// In the middle of the bone, at the usual distance, a drill is as loud as in mono.
TEST_P(StereoSynth, TheMiddleHasTheLevelOfMono) {
  DrillSynth synth = synth_in(GetParam()), mono = synth_in(Listening::mono);
  const ToolSound drill = tool_at(Vec3::Zero(), 1, test::cortical_drill(1345));
  const Sides sides = played(synth, {drill}, 1.0), plain = played(mono, {drill}, 1.0);
  const double own_db = sound::rms_db(plain.left);
  EXPECT_NEAR(sound::rms_db(sides.left), own_db, 0.1);
  EXPECT_NEAR(sound::rms_db(sides.right), own_db, 0.1);
}

TEST_P(StereoSynth, TheSuckerIsHeardWhereItsToolIs) {
  DrillSynth synth = synth_in(GetParam());
  CuttingState state = test::idle_drill();
  state.suction = true;
  const Sides sides = played(synth, {tool_at({0, 0, -200}, 1, state)}, 1.0);
  EXPECT_GT(sound::peak(sides.right), 0.002);
  if (GetParam() != Listening::mono) {
    EXPECT_GT(sound::rms_db(sides.right), sound::rms_db(sides.left) + 3);
  }
}

TEST_P(StereoSynth, FallsSilentAfterTheLastSoundHasArrived) {
  DrillSynth synth = synth_in(GetParam());
  EXPECT_TRUE(synth.silent());
  static_cast<void>(played(synth, {tool_at({0, 0, 2000}, 1, test::cortical_drill(1345))}, 0.3));
  EXPECT_FALSE(synth.silent());
  const Sides after = played(synth, {}, 2.0);
  EXPECT_TRUE(synth.silent());
  EXPECT_GT(sound::peak(after.left), 1e-3) << "it runs down";
  EXPECT_EQ(sound::peak(std::span(after.left).last(4800)), 0);
  EXPECT_EQ(sound::peak(std::span(after.right).last(4800)), 0);
}

// 8.5.4: perforation is the loudest moment. A head makes the ear's frequencies louder, and the limiter must leave that.
TEST_P(StereoSynth, PerforationIsTheLoudestMoment) {
  SynthParams params = params_in(GetParam());
  if (GetParam() == Listening::headphones) {
    auto kemar = read_hrtf({}, kRate_hz);
    ASSERT_TRUE(kemar) << kemar.error().message;
    params.space.hrtf = std::make_shared<const Hrtf>(std::move(*kemar));
  }
  DrillSynth synth;
  synth.prepare(params);
  const auto level_db = [&](const ToolSound& tool, double seconds) {
    const Sides sides = played(synth, {tool}, seconds);
    const std::size_t end = std::min<std::size_t>(sides.left.size(), 4800);
    const double left_db = sound::rms_db(std::span(sides.left).last(end)),
                 right_db = sound::rms_db(std::span(sides.right).last(end));
    return std::max(left_db, right_db);
  };
  static_cast<void>(level_db(test::free_tool(), 0.75));
  const double cortical_db = level_db(test::cortical_tool(), 1.0);
  ToolSound plunge = test::free_tool();
  plunge.advancing = true;
  plunge.load = 0.02;
  EXPECT_GT(level_db(plunge, 0.1), cortical_db + 3.0) << "3 dB are an obvious difference (8.6.3)";
}

// A broach is silent between its blows. Where it was at the last one does not count.
TEST_P(StereoSynth, ABlowIsHeardWhereTheBroachIsNow) {
  ToolSound broach = tool_at({0, 0, 300}, 1, test::idle_drill());
  broach.tool = "broach-1";
  const auto blow_at = [&](double z_mm, DrillSynth& synth) {
    broach.tip_mm = {0, 0, z_mm};
    ++broach.blows;
    broach.blow_impulse_N_s = 2.8;
    return played(synth, {broach}, 3.0);
  };
  DrillSynth moved = synth_in(GetParam()), fresh = synth_in(GetParam());
  static_cast<void>(played(moved, {broach}, 0.1));
  ASSERT_GT(sound::peak(blow_at(300, moved).left), 0.001);
  const Sides there = blow_at(-300, moved);
  broach.blows = 0;
  broach.tip_mm = {0, 0, -300};
  static_cast<void>(played(fresh, {broach}, 0.1));
  const Sides alone = blow_at(-300, fresh);
  EXPECT_NEAR(sound::rms_db(std::span(there.left).first(4800)), sound::rms_db(std::span(alone.left).first(4800)), 0.5);
  EXPECT_NEAR(sound::rms_db(std::span(there.right).first(4800)), sound::rms_db(std::span(alone.right).first(4800)),
              0.5);
}

TEST_P(StereoSynth, OneChannelIsTheMeanOfBoth) {
  const ToolSound drill = tool_at({10, 20, 90}, 1, test::free_drill(1400));
  DrillSynth synth = synth_in(GetParam()), single = synth_in(GetParam());
  const Sides sides = played(synth, {drill}, 0.3);
  std::vector<float> mono(sides.left.size());
  single.aim(scene({drill}));
  single.process(mono);
  for (std::size_t n = 0; n < mono.size(); ++n) ASSERT_EQ(mono[n], 0.5F * (sides.left[n] + sides.right[n]));
}

// On the sound card's thread, with a tool that turns round the listener, and one that comes and goes.
TEST_P(StereoSynth, TheEngineDoesNotAllocate) {
  SoundEngine engine(params_in(GetParam()));
  std::vector<float> left(256), right(256);
  const test::AllocationCounter heap;
  for (int i = 0; i < 400; ++i) {
    SoundScene now;
    now.tools[0] = ToolSound{};
    now.tools[0].author = 1;
    now.tools[0].state_seq = static_cast<std::uint64_t>(i);
    now.tools[0].rpm = 1300;
    now.tools[0].load = 0.5;
    now.tools[0].tip_mm = Vec3(-100 + 300 * std::cos(0.1 * i), -100, 300 * std::sin(0.1 * i));
    now.tools[1] = now.tools[0];
    now.tools[1].author = 2;
    now.tools[1].suction = true;
    now.count = 1 + i / 50 % 2;
    engine.deliver(now);
    engine.render(left, right);
  }
  EXPECT_EQ(heap.count(), 0);
  EXPECT_GT(engine.peak(), 0.01F);
}

// The way of the sound is in what the engine states: half a metre takes 1.46 ms.
TEST(StereoEngine, StatedLatencyHasTheWayToTheListener) {
  for (const Listening way : {Listening::mono, Listening::loudspeakers, Listening::headphones}) {
    SoundEngine engine(params_in(way));
    std::vector<float> left(4096), right(4096);
    engine.deliver(scene({tool_at(Vec3::Zero(), 1, test::free_drill(1400))}));
    engine.render(left, right);
    const auto first = std::ranges::find_if(left, [](float x) { return x != 0; }) - left.begin();
    const double stated = std::chrono::duration<double>(engine.latency()).count() * kRate_hz;
    // The cubic between frames begins two frames before, and the ramp of the sound starts at zero.
    EXPECT_GE(static_cast<double>(first), stated - 3);
    EXPECT_LE(static_cast<double>(first), stated + 5);
  }
}

}  // namespace
}  // namespace osteon::audio
