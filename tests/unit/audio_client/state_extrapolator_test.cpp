// The tools at the moment of playing: what a closed form says of a tool whose states come late, unevenly or not at all,
// from a machine with another clock.
#include "audio_client/synth/state_extrapolator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "audio_client/synth/drill_synth.hpp"
#include "common/sound/tones.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::audio {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kPeriod_ns = 16 * kMs;     // of the states
constexpr std::int64_t kBuffer_ns = 5'333'333;    // of the sound
constexpr std::int64_t kStart_ns = 50'000 * kMs;  // of our clock
constexpr std::int64_t kShortest_ns = 3 * kMs;    // way of a state
constexpr double kSpeed_mm_per_s = 10.0, kRise_N_per_s = 20.0;

SoundScene scene_with(const ToolSound& tool, std::int64_t received_ns) {
  SoundScene scene;
  scene.count = 1;
  scene.tools[0] = tool;
  scene.received_ns = received_ns;
  return scene;
}

// A drill that goes evenly deeper, against a force that rises evenly. `sent_ns`: since it began.
ToolSound even_drill(std::uint64_t seq, std::int64_t sent_ns, std::int64_t clock_ns) {
  const double t_s = 1e-9 * static_cast<double>(sent_ns);
  CuttingState state = test::cortical_drill(1345);
  state.state_seq = seq;
  state.time_ns = clock_ns + sent_ns;
  state.pose_bone_tool.position_mm = {1.0, 2.0, -kSpeed_mm_per_s * t_s};
  state.depth_mm = kSpeed_mm_per_s * t_s;
  state.force_physical_N = {0, 0, kRise_N_per_s * t_s};
  return tool_sound(state);
}

// A hand that eases off from one state to the next. Computed ahead, the load would be nearly gone.
TEST(StateExtrapolator, AFallOfTheLoadIsNoBreakthrough) {
  StateExtrapolator states;
  const auto pushed = [&](std::uint64_t seq, double share) {
    ToolSound tool = even_drill(seq, static_cast<std::int64_t>(seq) * kPeriod_ns, 0);
    tool.load = share;
    tool.advancing = true;
    return scene_with(tool, kStart_ns + static_cast<std::int64_t>(seq) * kPeriod_ns);
  };
  states.take(pushed(1, 1.0));
  states.take(pushed(2, 0.55));
  const ToolSound ahead = states.at(kStart_ns + 3 * kPeriod_ns).tools[0];
  EXPECT_NEAR(ahead.load, 0.1, 1e-9);
  EXPECT_NEAR(ahead.load - ahead.load_ahead, 0.55, 1e-9);

  // The burst of a breakthrough rings near 200 Hz. A drill whose load stays has none, and neither has this one.
  const auto burst_db = [&](const ToolSound& after) {
    DrillSynth synth;
    synth.prepare({});
    SoundScene scene = scene_with(states.at(kStart_ns + 2 * kPeriod_ns).tools[0], 0);
    scene.tools[0].load = 1.0;
    std::vector<float> samples(48000), later(4800);
    synth.aim(scene);
    synth.process(samples);
    scene.tools[0] = after;
    synth.aim(scene);
    synth.process(later);
    return sound::tone_db(later, 48000, 200.0);
  };
  ToolSound through = ahead;
  through.load_ahead = 0.0;  // a state has said so, and that the bone is gone
  through.bone_g_cm3 = 0.0;
  EXPECT_GT(burst_db(through), burst_db(ahead) + 10.0);
}

struct Line {
  std::int64_t clock_ns = 0;                          // of the sender when it began
  std::function<std::int64_t(std::uint64_t)> way_ns;  // of a state
  std::function<bool(std::uint64_t)> lost = [](auto) { return false; };
};
// Plays an even drill for 4 s. Returns the largest errors of the second half: by then the shortest way is known.
struct Errors {
  double place_mm = 0, depth_mm = 0, force_N = 0;
};
Errors errors_of(const Line& line) {
  StateExtrapolator states;
  std::multimap<std::int64_t, ToolSound> coming;  // by arrival
  for (std::uint64_t seq = 1; seq <= 250; ++seq) {
    const std::int64_t sent_ns = static_cast<std::int64_t>(seq) * kPeriod_ns;
    if (!line.lost(seq)) coming.emplace(sent_ns + line.way_ns(seq), even_drill(seq, sent_ns, line.clock_ns));
  }
  Errors errors;
  for (std::int64_t now_ns = 0; now_ns < 3900 * kMs; now_ns += kBuffer_ns) {
    for (; !coming.empty() && coming.begin()->first <= now_ns; coming.erase(coming.begin()))
      states.take(scene_with(coming.begin()->second, kStart_ns + coming.begin()->first));
    if (now_ns < 2000 * kMs) continue;
    const ToolSound& tool = states.at(kStart_ns + now_ns).tools[0];
    // Where the drill was as long ago as the shortest way takes.
    const double t_s = 1e-9 * static_cast<double>(now_ns - kShortest_ns);
    errors.place_mm = std::max(errors.place_mm, (tool.tip_mm - Vec3(1.0, 2.0, -kSpeed_mm_per_s * t_s)).norm());
    errors.depth_mm = std::max(errors.depth_mm, std::abs(tool.depth_mm - kSpeed_mm_per_s * t_s));
    errors.force_N = std::max(errors.force_N, std::abs(tool.force_N - kRise_N_per_s * t_s));
  }
  return errors;
}

// Even motion is continued exactly, so the drill moves evenly although its states do not come evenly. Without, it would
// be behind by up to a period and the jitter: 0.3 mm. A tenth of the states come by the shortest way.
TEST(StateExtrapolator, AnEvenMotionStaysEvenWhenStatesComeUnevenly) {
  for (const std::int64_t clock_ns : {std::int64_t{1}, 7'200'000 * kMs, 40'000 * kMs}) {
    test::Random random(4);
    const Errors errors = errors_of(
        {clock_ns, [&](std::uint64_t seq) {
           return kShortest_ns + (seq % 10 == 0 ? 0 : static_cast<std::int64_t>(random.between(0.0, 15.0) * kMs));
         }});
    EXPECT_LT(errors.place_mm, 1e-6) << clock_ns;
    EXPECT_LT(errors.depth_mm, 1e-6) << clock_ns;
    // Forces go on for one period: a state that is 15 ms late leaves the next 15 ms without.
    EXPECT_LT(errors.force_N, kRise_N_per_s * 0.0155) << clock_ns;
  }
}

// With an even way the newest state is at most a period old, and so is its force.
TEST(StateExtrapolator, AnEvenlyRisingForceIsContinuedForAPeriod) {
  EXPECT_LT(errors_of({kMs, [](auto) { return kShortest_ns; }}).force_N, 1e-6);
}

// One lost state leaves the newest two periods old: just as far as it is continued.
TEST(StateExtrapolator, ALostStateIsBridged) {
  const Errors errors =
      errors_of({1, [](auto) { return kShortest_ns; }, [](std::uint64_t seq) { return seq % 4 == 0; }});
  EXPECT_LT(errors.place_mm, 1e-6);
}

// Of five lost states the tool stands still in the last four periods: no state says that it goes on.
TEST(StateExtrapolator, NothingGoesOnForMoreThanTwoPeriods) {
  const Errors errors =
      errors_of({1, [](auto) { return kShortest_ns; }, [](std::uint64_t seq) { return seq >= 170 && seq < 175; }});
  EXPECT_NEAR(errors.place_mm, kSpeed_mm_per_s * 4 * 0.016, kSpeed_mm_per_s * 1e-9 * kBuffer_ns);

  StateExtrapolator states;
  for (const std::uint64_t seq : {1, 2})
    states.take(scene_with(even_drill(seq, static_cast<std::int64_t>(seq) * kPeriod_ns, kMs),
                           static_cast<std::int64_t>(seq) * kPeriod_ns));
  const ToolSound late = states.at(3600 * std::int64_t{1000} * kMs).tools[0];
  EXPECT_NEAR(late.depth_mm, kSpeed_mm_per_s * 4 * 0.016, 1e-9);
  EXPECT_NEAR(late.force_N, kRise_N_per_s * 3 * 0.016, 1e-9);
}

class ContinuedState : public testing::Test {
 protected:
  // A state of the next period, which arrives at once. Returns it as it came.
  ToolSound take(double force_N, CuttingPhase phase = CuttingPhase::cutting, std::uint32_t blows = 0) {
    ++seq_;
    ToolSound tool = even_drill(seq_, static_cast<std::int64_t>(seq_) * kPeriod_ns, kMs);
    tool.force_N = force_N;
    tool.phase = phase;
    tool.blows = blows;
    states_.take(scene_with(tool, kMs + static_cast<std::int64_t>(seq_) * kPeriod_ns));
    return tool;
  }
  double force_after(std::int64_t later_ns) { return after(later_ns).force_N; }
  ToolSound after(std::int64_t later_ns) {
    return states_.at(kMs + static_cast<std::int64_t>(seq_) * kPeriod_ns + later_ns).tools[0];
  }
  std::uint64_t seq_ = 0;
  StateExtrapolator states_;
};

// A step from 5 to 20 N goes on by as much again at most, and is over with the next state.
TEST_F(ContinuedState, AStepGoesOnByItsOwnHeightAtMostAndOnlyUntilTheNextState) {
  take(5.0);
  take(5.0);
  take(20.0);
  EXPECT_NEAR(force_after(0), 20.0, 1e-9);
  EXPECT_NEAR(force_after(kPeriod_ns / 2), 27.5, 1e-9);
  EXPECT_NEAR(force_after(10 * kPeriod_ns), 35.0, 1e-9);
  take(20.0);
  EXPECT_NEAR(force_after(10 * kPeriod_ns), 20.0, 1e-9);
  take(5.0);
  EXPECT_EQ(force_after(10 * kPeriod_ns), 0.0) << "a force has no sign";
}

TEST_F(ContinuedState, NothingButThePlaceGoesOnAcrossAPhase) {
  take(0.0, CuttingPhase::free);
  take(25.0);
  EXPECT_EQ(force_after(kPeriod_ns), 25.0);
  EXPECT_EQ(after(kPeriod_ns).phase, CuttingPhase::cutting);
  EXPECT_NEAR(after(kPeriod_ns).depth_mm, kSpeed_mm_per_s * 3 * 0.016, 1e-9);
  take(25.0);
  take(0.0, CuttingPhase::free);
  EXPECT_EQ(force_after(kPeriod_ns), 0.0);
}

// A blow drives a broach in 5 ms and then it stands, whatever two states make of that.
TEST_F(ContinuedState, NothingGoesOnAcrossABlow) {
  take(20.0, CuttingPhase::cutting, 3);
  const ToolSound struck = take(60.0, CuttingPhase::cutting, 4);
  EXPECT_EQ(force_after(kPeriod_ns), 60.0);
  EXPECT_EQ(after(kPeriod_ns).depth_mm, struck.depth_mm);
  EXPECT_EQ(after(kPeriod_ns).blows, 4U);
}

TEST_F(ContinuedState, AnOldOrRepeatedStateChangesNothing) {
  const ToolSound first = take(10.0), second = take(12.0), third = take(14.0);
  const ToolSound before = after(kPeriod_ns / 2);
  const std::int64_t now_ns = kMs + 3 * kPeriod_ns + kPeriod_ns / 2;
  for (const ToolSound& old : {third, second, first, third}) {
    states_.take(scene_with(old, now_ns));
    const ToolSound& now = states_.at(now_ns).tools[0];
    EXPECT_EQ(now.state_seq, 3U);
    EXPECT_EQ(now.force_N, before.force_N);
    EXPECT_EQ(now.tip_mm, before.tip_mm);
  }
}

// A client that was started again, on a machine that runs for an hour less.
TEST_F(ContinuedState, ANewSenderIsFollowedFromItsFirstStatesOn) {
  for (int i = 0; i < 100; ++i) take(10.0);
  const std::int64_t again_ns = kMs + 100 * kPeriod_ns + 2'000 * kMs;
  for (const std::uint64_t seq : {1, 2})
    states_.take(scene_with(even_drill(seq, static_cast<std::int64_t>(seq) * kPeriod_ns, 5),
                            again_ns + static_cast<std::int64_t>(seq) * kPeriod_ns));
  const ToolSound& tool = states_.at(again_ns + 3 * kPeriod_ns).tools[0];
  EXPECT_EQ(tool.state_seq, 2U);
  EXPECT_NEAR(tool.depth_mm, kSpeed_mm_per_s * 3 * 0.016, 1e-9);
}

// What a server plays from a journal, or an older client sends, has no times.
TEST_F(ContinuedState, AStateWithoutATimeStaysAsItCame) {
  for (const double force_N : {10.0, 20.0}) {
    ToolSound tool = even_drill(1, kPeriod_ns, 0);
    tool.time_ns = 0;
    tool.force_N = force_N;
    states_.take(scene_with(tool, kStart_ns));
    EXPECT_FALSE(states_.moves());
    EXPECT_EQ(states_.at(kStart_ns + kPeriod_ns).tools[0].force_N, force_N);
  }
}

// Two persons with clocks an hour apart. One of them leaves.
TEST(StateExtrapolator, EachToolHasItsOwnClockAndALeavingOneIsForgotten) {
  StateExtrapolator states;
  SoundScene both;
  both.count = 2;
  for (const std::uint64_t seq : {1, 2, 3}) {
    const auto sent_ns = static_cast<std::int64_t>(seq) * kPeriod_ns;
    both.tools[0] = even_drill(seq, sent_ns, kMs);
    both.tools[1] = even_drill(seq + 50, 2 * sent_ns, 3'600'000 * kMs);  // twice as fast, by a slow clock of ours
    both.tools[1].author = 2;
    both.tools[1].time_ns -= sent_ns;
    both.received_ns = kStart_ns + sent_ns;
    states.take(both);
  }
  const SoundScene& now = states.at(kStart_ns + 4 * kPeriod_ns);
  EXPECT_NEAR(now.tools[0].depth_mm, kSpeed_mm_per_s * 4 * 0.016, 1e-9);
  EXPECT_NEAR(now.tools[1].depth_mm, kSpeed_mm_per_s * 8 * 0.016, 1e-9);

  both.tools[0] = both.tools[1];
  both.count = 1;
  both.received_ns += kPeriod_ns;
  states.take(both);
  const SoundScene& alone = states.at(kStart_ns + 4 * kPeriod_ns);
  ASSERT_EQ(alone.count, 1);
  EXPECT_EQ(alone.tools[0].author, 2U);
  EXPECT_NEAR(alone.tools[0].depth_mm, kSpeed_mm_per_s * 8 * 0.016, 1e-9);
}

// Our clock runs faster by 100 millionths: a minute's difference is 6 ms. Only the last 8 s count: 0.8 ms.
TEST(RecentLeast, FollowsClocksThatDrift) {
  RecentLeast offset;
  for (std::int64_t sent_ns = 0; sent_ns < 60'000 * kMs; sent_ns += kPeriod_ns) {
    const std::int64_t arrived_ns = kStart_ns + sent_ns + sent_ns / 10'000;
    offset.add(arrived_ns - sent_ns, arrived_ns);
  }
  EXPECT_LE(offset.least(), kStart_ns + 6 * kMs);
  EXPECT_GE(offset.least(), kStart_ns + 6 * kMs - kMs * 9 / 10);
}

TEST(StateExtrapolator, DoesNotAllocate) {
  StateExtrapolator states;
  const SoundScene first = scene_with(even_drill(1, kPeriod_ns, kMs), kStart_ns),
                   second = scene_with(even_drill(2, 2 * kPeriod_ns, kMs), kStart_ns + kPeriod_ns);
  const test::AllocationCounter heap;
  states.take(first);
  states.take(second);
  static_cast<void>(states.at(kStart_ns + 2 * kPeriod_ns));
  EXPECT_EQ(heap.count(), 0);
}

TEST(ToolSound, HasWhatTheStateSays) {
  CuttingState state = test::cortical_drill(1345);
  state.tool_name = "broach-2";
  state.author = {3};
  state.time_ns = 77;
  state.cortex_mm = 4.5;
  state.seated = 0.25;
  state.blows = 12;
  state.blow_impulse_N_s = 2.8;
  state.pose_bone_tool.position_mm = {1, 2, 3};
  state.depth_mm = 6;
  state.torque_Nmm = -25;
  const ToolSound sound = tool_sound(state);
  EXPECT_EQ(sound.tool, "broach-2");
  EXPECT_EQ(sound.time_ns, 77);
  EXPECT_EQ(sound.cortex_mm, 4.5);
  EXPECT_EQ(sound.seated, 0.25);
  EXPECT_EQ(sound.blows, 12U);
  EXPECT_EQ(sound.blow_impulse_N_s, 2.8);
  EXPECT_EQ(sound.tip_mm, Vec3(1, 2, 3));
  EXPECT_EQ(sound.depth_mm, 6);
  EXPECT_EQ(sound.force_N, 27);
  EXPECT_EQ(sound.torque_Nmm, 25);
  EXPECT_EQ(sound.feed_mm_per_s, 0.89);
  EXPECT_EQ(sound.density_g_cm3, 1.9);
  state.tool_name = "of-the-room-alone";
  EXPECT_EQ(tool_sound(state).tool, "");
  state.phase = CuttingPhase::free;
  EXPECT_EQ(tool_sound(state).force_N, 0.0) << "without contact";
}

}  // namespace
}  // namespace osteon::audio
