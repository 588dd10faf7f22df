// Measures the drill's sound as a listener would: the synthesised signal goes through common/sound.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <numeric>
#include <vector>

#include "audio_client/presets/preset_file.hpp"
#include "audio_client/synth/drill_synth.hpp"
#include "audio_client/synth/limiter.hpp"
#include "common/sound/gearbox.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/spectrum.hpp"
#include "common/sound/tones.hpp"
#include "common/tools/tool.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::audio {
namespace {

using test::cancellous_drill;
using test::cortical_drill;
using test::free_drill;
using test::idle_drill;
using test::kRate_hz;
using test::play;

DrillSynth make_synth(std::uint64_t seed = 1, const VoiceParams& voice = {}) {
  DrillSynth synth;
  synth.prepare({.rate_hz = kRate_hz, .seed = seed, .voice = voice});
  return synth;
}

// Without noise and flutter, only the partials are left.
constexpr VoiceParams kPure{.noise = 0, .flutter = 0};

CuttingState burr(double rpm, double density_g_cm3) {
  CuttingState state = free_drill(rpm);
  state.tool_name = "burr-round-5";
  if (density_g_cm3 > 0) {
    state.phase = CuttingPhase::cutting;
    state.density_g_cm3 = density_g_cm3;
    state.feed_mm_per_s = 10;
    state.force_physical_N = Vec3(0, 0, 3.0 * density_g_cm3 / 1.9);
    state.torque_Nmm = 2.0 * density_g_cm3 / 1.9;
  }
  return state;
}

// One second of the steady sound.
std::vector<float> steady(const CuttingState& state, const VoiceParams& voice = {}, std::uint64_t seed = 1) {
  DrillSynth synth = make_synth(seed, voice);
  static_cast<void>(play(synth, state, 0.75));
  return play(synth, state, 1.0);
}

double brightness_hz(const std::vector<float>& samples) {
  return sound::centroid_hz(sound::power_spectrum(samples, kRate_hz), 20, 20000);
}

class SpindleSpeed : public testing::TestWithParam<double> {};

TEST_P(SpindleSpeed, PartialsAreLockedToTheSpindle) {
  const double spindle_hz = GetParam() / 60.0;
  const std::vector<float> samples = steady(cortical_drill(GetParam()));
  constexpr sound::Gearbox gears;
  for (const double ratio : {gears.output_mesh(), 2 * gears.output_mesh(), gears.motor_mesh(),
                             3 * sound::kCommutatorSegments * gears.motor()}) {
    const double hz = ratio * spindle_hz;
    // One second of a line in noise: far more accurate than the 1 Hz of a plain spectrum.
    EXPECT_NEAR(sound::find_tone(samples, kRate_hz, hz - 15, hz + 15).hz, hz, 0.05) << "ratio " << ratio;
  }
}
INSTANTIATE_TEST_SUITE_P(Drills, SpindleSpeed, testing::Values(600.0, 1000.0, 1345.0, 1400.0));

TEST(DrillSound, PitchDroopsWithTheSpindleUnderLoad) {
  // The state's spindle speed includes the droop. The sound repeats it, line by line.
  DrillSynth synth = make_synth();
  static_cast<void>(play(synth, free_drill(1000), 0.75));
  const std::vector<float> samples = play(synth, cortical_drill(955), 1.0);
  const double mesh_hz = sound::Gearbox{}.output_mesh() * 1000 / 60.0;
  const std::vector<double> track = sound::track_tone(samples, kRate_hz, mesh_hz, {.reach = 0.06});
  ASSERT_FALSE(track.empty());
  EXPECT_NEAR(track.back() / mesh_hz, 0.955, 1e-3);
}

TEST(DrillSound, GrowsFromFreeOverCancellousToCortical) {
  const double free_db = sound::rms_db(steady(free_drill(1400)));
  const double cancellous_db = sound::rms_db(steady(cancellous_drill(1380)));
  const double cortical_db = sound::rms_db(steady(cortical_drill(1345)));
  // 8.6.3: 3 dB to 5 dB are an obvious difference in loudness.
  EXPECT_GT(cancellous_db, free_db + 3);
  EXPECT_GT(cortical_db, cancellous_db + 4);
  EXPECT_LT(cortical_db, -10) << "leaves level for other tools";
}

TEST(DrillSound, CorticalIsBrighterThanCancellous) {
  const double soft = brightness_hz(steady(cancellous_drill(1380)));
  const double middle = [&] {
    CuttingState state = cortical_drill(1360);
    state.density_g_cm3 = 1.0;
    state.force_physical_N = Vec3(0, 0, 19);
    state.torque_Nmm = 17;
    return brightness_hz(steady(state));
  }();
  const double hard = brightness_hz(steady(cortical_drill(1345)));
  EXPECT_GT(middle, soft + 100);
  EXPECT_GT(hard, middle + 100);
}

TEST(DrillSound, MotorLeadsWhereThereIsLoadOrNoneAndTheGearsBetween) {
  // 8.5.4: free and cortical, 5500 Hz is stronger than 4000 Hz. Cancellous, it is the other way round.
  constexpr sound::Gearbox gears;
  const auto lead_db = [&](const CuttingState& state) {
    const std::vector<float> samples = steady(state);
    const double spindle_hz = state.spindle_rpm / 60.0;
    return sound::tone_db(samples, kRate_hz, 3 * sound::kCommutatorSegments * gears.motor() * spindle_hz) -
           sound::tone_db(samples, kRate_hz, gears.motor_mesh() * spindle_hz);
  };
  EXPECT_GT(lead_db(free_drill(1400)), 1);
  EXPECT_LT(lead_db(cancellous_drill(1380)), -1);
  EXPECT_GT(lead_db(cortical_drill(1345)), 1);
}

TEST(DrillSound, LowBandFillsWhileCutting) {
  // 8.5.4: 0-400 Hz is quiet running free and strongest in cortical bone.
  const auto low_db = [](const CuttingState& state) {
    return sound::band_db(sound::power_spectrum(steady(state), kRate_hz), 0, 400);
  };
  EXPECT_GT(low_db(cancellous_drill(1380)), low_db(free_drill(1400)) + 3);
  EXPECT_GT(low_db(cortical_drill(1345)), low_db(cancellous_drill(1380)) + 3);
}

TEST(DrillSound, FasterIsLouder) {
  EXPECT_GT(sound::rms_db(steady(free_drill(1400))), sound::rms_db(steady(free_drill(700))) + 3);
}

TEST(DrillSound, SlowlyCutIsQuieterAtEqualDensity) {
  CuttingState light = cortical_drill(1380);
  light.force_physical_N = Vec3(0, 0, 8);
  light.torque_Nmm = 7;
  light.feed_mm_per_s = 0.1;
  EXPECT_GT(sound::rms_db(steady(cortical_drill(1380))), sound::rms_db(steady(light)) + 3);
}

TEST(DrillSound, ChipsAreHeardBesideTheLines) {
  const auto noise = [](const VoiceParams& voice) {
    // The remaining level of one second, at a speed without lines between 6300 and 6600 Hz.
    return sound::band_db(sound::power_spectrum(steady(cortical_drill(1345), voice), kRate_hz), 6300, 6400);
  };
  EXPECT_GT(noise({}), noise(kPure) + 10);
}

TEST(BurrSound, PartialsFollowTheSpindleAndGrowWithDensity) {
  const double rpm = 20000;
  const std::vector<float> samples = steady(burr(rpm, 1.9));
  const double flutes_hz = 8 * rpm / 60.0;
  EXPECT_NEAR(sound::find_tone(samples, kRate_hz, flutes_hz - 20, flutes_hz + 20).hz, flutes_hz, 0.05);
  const double free_db = sound::rms_db(steady(burr(rpm, 0)));
  const double cancellous_db = sound::rms_db(steady(burr(rpm, 0.3)));
  const double cortical_db = sound::rms_db(samples);
  EXPECT_GT(cancellous_db, free_db + 0.5);
  EXPECT_GT(cortical_db, cancellous_db + 4);
  EXPECT_GT(brightness_hz(samples), brightness_hz(steady(burr(rpm, 0.3))));
}

TEST(BurrSound, HighestSpeedsDoNotFoldBack) {
  // Every line must lie on a partial. The folded 24 kHz and 32 kHz of a 60 000 rpm burr would be at 24 and 16 kHz,
  // those of 57 000 rpm at 17.6 kHz.
  const Tool tool = *find_tool("burr-round-5");
  for (const double rpm : {57000.0, 60000.0, 90000.0}) {
    const std::vector<float> samples = steady(burr(rpm, 1.9), kPure);
    const sound::Spectrum spectrum = sound::power_spectrum(samples, kRate_hz, 16384);
    const Handpiece piece = make_handpiece(*preset_for(builtin_presets(), "", "round-burr"), &tool, kRate_hz);
    double strange = 0, all = 0;
    for (std::size_t k = 0; k < spectrum.power.size(); ++k) {
      const double hz = static_cast<double>(k) * spectrum.bin_hz;
      const bool expected = std::any_of(piece.partials.begin(), piece.partials.end(), [&](const Partial& p) {
        // The Hann window's skirts have fallen by 100 dB there.
        return std::abs(p.ratio * rpm / 60.0 - hz) < 32 * spectrum.bin_hz;
      });
      all += spectrum.power[k];
      if (!expected) strange += spectrum.power[k];
    }
    EXPECT_GT(all, 0);
    EXPECT_LT(10 * std::log10(strange / all), -70) << rpm << " rpm";
    EXPECT_LT(sound::band_db(spectrum, 21500, 24001), -90) << rpm << " rpm";
  }
}

TEST(DrillSound, RunsUpAndDownInsteadOfJumping) {
  DrillSynth synth = make_synth();
  const std::vector<float> up = play(synth, free_drill(1400), 0.5);
  // After half of the run-up time: the mesh is near half of its frequency, and the level is below the final one.
  const auto part = [&](double from_s, double to_s) {
    return std::vector<float>(up.begin() + static_cast<int>(from_s * kRate_hz),
                              up.begin() + static_cast<int>(to_s * kRate_hz));
  };
  EXPECT_LT(sound::rms_db(part(0.0, 0.05)), sound::rms_db(part(0.4, 0.5)) - 12);
  EXPECT_LT(sound::rms_db(part(0.1, 0.15)), sound::rms_db(part(0.4, 0.5)) - 3);
  const std::vector<float> down = play(synth, idle_drill(), 1.0);
  EXPECT_GT(sound::peak(std::span(down).first(4800)), 1e-3) << "it still turns";
  EXPECT_EQ(sound::peak(std::span(down).last(4800)), 0) << "it stands still";
  EXPECT_TRUE(synth.silent());
}

// The level near 200 Hz after a drill has gone 1 mm/s deeper in cortical bone for a second, and then goes on as `after`
// says. 8.5.4: perforation is a burst of energy there. Noise is off, so that the drill alone is compared.
double low_after_cortex_db(const std::function<CuttingState(int number, const CuttingState& last)>& after) {
  DrillSynth synth = make_synth(1, kPure);
  CuttingState state = cortical_drill(1345);
  for (int i = 0; i < 120; ++i) {
    state.pose_bone_tool.position_mm.z() -= 1.0 / 120;
    static_cast<void>(play(synth, std::vector{state}));
  }
  std::vector<float> samples;
  for (int i = 0; i < 12; ++i) {
    const std::vector<float> part = play(synth, std::vector{after(i, state)});
    samples.insert(samples.end(), part.begin(), part.end());
  }
  // After the fall of the load itself, and within the knock's decay.
  return sound::band_db(sound::power_spectrum(std::span(samples).subspan(2000, 2048), kRate_hz, 2048), 100, 300);
}

// A state without bone, whose tip has gone on in the air.
CuttingState gone_on(const CuttingState& last, double mm) {
  CuttingState state = free_drill(1345);
  state.pose_bone_tool.position_mm = last.pose_bone_tool.position_mm - Vec3(0, 0, mm);
  return state;
}

TEST(DrillSound, KnocksWhenBoneGivesWay) {
  // A hand falls by 45 mm/s.
  const double through_db = low_after_cortex_db([](int i, const auto& last) { return gone_on(last, 0.375 * (i + 1)); });
  const double drawn_back_db =
      low_after_cortex_db([](int i, const auto& last) { return gone_on(last, -0.375 * (i + 1)); });
  EXPECT_GT(through_db, drawn_back_db + 10);
  // The last of the point is still in bone, and goes on.
  const double last_of_point_db = low_after_cortex_db([](int, const CuttingState& last) {
    CuttingState state = last;
    state.engaged_fraction = 0.01;
    state.force_physical_N = Vec3(0, 0, 0.5);
    state.torque_Nmm = 0.5;
    return state;
  });
  EXPECT_NEAR(last_of_point_db, through_db, 3);
}

TEST(DrillSound, DoesNotKnockWhenAStateLacksBoneOrForce) {
  const double knock_db =
      low_after_cortex_db([](int i, const auto& last) { return gone_on(last, 0.375 * (i + 1)); }) - 10;
  // The haptic loop waits for its part of the bone: neither bone nor load, and the tip stays where the last tick was.
  EXPECT_LT(low_after_cortex_db([](int, const auto& last) { return gone_on(last, 0.01); }), knock_db);
  // It comes back in the same bone.
  EXPECT_LT(low_after_cortex_db([](int i, const auto& last) { return i < 6 ? gone_on(last, 0) : last; }), knock_db);
  // The hand eases off, and the drill still feeds a little.
  EXPECT_LT(low_after_cortex_db([](int, const CuttingState& last) {
              CuttingState state = last;
              state.force_physical_N = Vec3(0, 0, 0.5);
              state.torque_Nmm = 0.5;
              state.feed_mm_per_s = 0.01;
              return state;
            }),
            knock_db);
  // The drill's side rubs, and slips a little.
  EXPECT_LT(low_after_cortex_db([](int, const auto& last) {
              CuttingState state = gone_on(last, 0.2);
              state.phase = CuttingPhase::rubbing;
              state.force_physical_N = Vec3(0, 0, 5);
              return state;
            }),
            knock_db);
}

// The largest level near 200 Hz while a tool is in the air. For a second before it was in bone as `in_bone` says. It
// goes on by `step_mm` in each 1/120 s, there and in the air. Of the states in the air, the first `lost` do not come.
double low_after_leaving_db(CuttingState in_bone, const Vec3& step_mm, int lost = 0) {
  DrillSynth synth = make_synth(1, kPure);
  CuttingState in_air = free_drill(in_bone.spindle_rpm);
  in_air.tool_name = in_bone.tool_name;
  std::vector<float> samples;
  for (int i = 0; i < 150; ++i) {
    CuttingState& state = i < 120 ? in_bone : in_air;
    state.pose_bone_tool.position_mm = i * step_mm;
    state.time_ns = 1'000'000'000 + std::llround(i * 1e9 / 120);
    const bool comes = i < 120 || i >= 120 + lost;
    const std::vector<float> part = play(synth, std::vector{comes ? state : in_bone});
    if (i >= 120 + lost) samples.insert(samples.end(), part.begin(), part.end());
  }
  double most_db = sound::kSilence_db;
  // The fall of the load itself takes 40 ms.
  for (std::size_t from = 2000; from + 2048 <= samples.size(); from += 1024)
    most_db = std::max(
        most_db,
        sound::band_db(sound::power_spectrum(std::span(samples).subspan(from, 2048), kRate_hz, 2048), 100, 300));
  return most_db;
}

TEST(DrillSound, KnocksOnlyWhenItFallsOnAlongItsAxis) {
  const auto leaves_db = [](const Vec3& mm_per_s, int lost = 0) {
    return low_after_leaving_db(cortical_drill(1345), mm_per_s / 120, lost);
  };
  const double held_db = leaves_db({0, 0, 0});
  for (const double mm_per_s : {25.0, 45.0, 300.0})
    EXPECT_GT(leaves_db({0, 0, -mm_per_s}), held_db + 10) << mm_per_s << " mm/s deeper";
  // A machine that feeds evenly goes on so in the air, and makes no knock, neither soon nor late.
  for (const double mm_per_s : {2.0, 5.0, 10.0, 15.0})
    EXPECT_LT(leaves_db({0, 0, -mm_per_s}), held_db + 1) << mm_per_s << " mm/s deeper";
  EXPECT_LT(leaves_db({0, 0, -10}, 5), held_db + 1) << "0.5 mm farther, in the time of six states";
  EXPECT_LT(leaves_db({0, 0, 30}), held_db + 1) << "drawn back";
  EXPECT_LT(leaves_db({30, 0, 0}), held_db + 1) << "along the surface";
  EXPECT_LT(leaves_db({30, 0, 5}), held_db + 1) << "along the surface, and lifted";
}

TEST(BurrSound, DoesNotKnockAtTheEndOfAStroke) {
  CuttingState stroke = burr(40000, 1.9);
  stroke.engaged_fraction = 0.2;
  stroke.feed_mm_per_s = 30;
  stroke.force_physical_N = Vec3(0, 0, 5);
  stroke.torque_Nmm = 1;
  const double held_db = low_after_leaving_db(stroke, Vec3::Zero());
  for (const Vec3& mm_per_s : {Vec3(30, 0, 0), Vec3(0, 0, 30), Vec3(21, 0, 21), Vec3(0, 0, -30)})
    EXPECT_LT(low_after_leaving_db(stroke, mm_per_s / 120), held_db + 1) << mm_per_s.transpose();

  // The last of a layer gives way under a burr that still feeds.
  DrillSynth synth = make_synth(1, kPure);
  static_cast<void>(play(synth, stroke, 1.0));
  stroke.engaged_fraction = 0.005;
  stroke.force_physical_N = Vec3(0, 0, 0.1);
  stroke.torque_Nmm = 0.02;
  const std::vector<float> through = play(synth, stroke, 0.1);
  EXPECT_GT(sound::band_db(sound::power_spectrum(std::span(through).subspan(2000, 2048), kRate_hz, 2048), 100, 300),
            held_db + 20);
}

TEST(DrillSound, SilentAtRest) {
  DrillSynth synth = make_synth();
  EXPECT_TRUE(synth.silent());
  EXPECT_EQ(sound::peak(play(synth, idle_drill(), 0.5)), 0);
  EXPECT_TRUE(synth.silent());
}

CuttingState with_suction(CuttingState state) {
  state.suction = true;
  return state;
}

// A sucker is heard without a drill that turns, and is a soft hiss without tones beside one that does.
TEST(SuctionSound, IsHeardAloneAndSoftlyBesideTheDrill) {
  const std::vector<float> alone = steady(with_suction(idle_drill()));
  const double hiss_db = sound::band_db(sound::power_spectrum(alone, kRate_hz), 500, 8000);
  const double drill_db = sound::band_db(sound::power_spectrum(steady(cortical_drill(1345)), kRate_hz), 500, 8000);
  std::printf("  suction %.1f dB, a drill in cortical bone %.1f dB\n", hiss_db, drill_db);
  EXPECT_GT(sound::peak(alone), 0.005);
  EXPECT_LT(hiss_db, drill_db - 6.0);
  // No line stands out of the band: a tone would hold most of the power in a few bins.
  const auto share = [&](double from_hz, double to_hz) {
    return std::pow(10.0, 0.1 * (sound::band_db(sound::power_spectrum(alone, kRate_hz), from_hz, to_hz) - hiss_db));
  };
  for (int hz = 500; hz < 7900; hz += 100) EXPECT_LT(share(hz, hz + 100), 0.1) << hz;
}

TEST(SuctionSound, SwellsAndFadesWithoutAClickAndFallsSilent) {
  DrillSynth synth = make_synth();
  std::vector<float> all = play(synth, idle_drill(), 0.1);
  for (const CuttingState& state : {with_suction(idle_drill()), idle_drill()}) {
    const std::vector<float> part = play(synth, state, 1.5);
    all.insert(all.end(), part.begin(), part.end());
  }
  // A hiss has steps of its own. The ends add none.
  const double own_step = sound::largest_step(std::span(all).subspan(48000, 24000));
  EXPECT_LT(sound::largest_step(all), 1.5 * own_step);
  EXPECT_EQ(sound::peak(std::span(all).last(4800)), 0);
  EXPECT_TRUE(synth.silent());
}

TEST(DrillSound, ResetSilencesAtOnceAndStartsAgainAlike) {
  DrillSynth synth = make_synth();
  const std::vector<float> first = play(synth, cortical_drill(1345), 0.5);
  synth.reset();
  std::vector<float> rest(4800, 1.0F);
  synth.process(rest);
  EXPECT_EQ(sound::peak(rest), 0);
  synth.reset();
  EXPECT_EQ(play(synth, cortical_drill(1345), 0.5), first);
}

TEST(DrillSound, ToolThatLeavesTheRoomRunsDown) {
  DrillSynth synth = make_synth();
  static_cast<void>(play(synth, cortical_drill(1345), 0.5));
  synth.aim(SoundScene{});
  std::vector<float> after(48000);
  synth.process(after);
  EXPECT_LT(sound::largest_step(after), 0.25);
  EXPECT_EQ(sound::peak(std::span(after).last(4800)), 0);
}

TEST(DrillSound, EqualSeedsMakeEqualSamplesWhateverTheBlocks) {
  const test::ScriptedDrilling script = test::scripted_drilling();
  const std::vector<CuttingState> part(script.states.begin() + 240, script.states.begin() + 360);
  DrillSynth one = make_synth(7), two = make_synth(7), other = make_synth(8);
  const std::vector<float> whole = play(one, part);
  std::vector<float> pieces(whole.size());
  for (std::size_t i = 0; i < part.size(); ++i) {
    two.aim(sound_scene(std::span(&part[i], 1), 0));
    std::span<float> frames = std::span(pieces).subspan(i * test::kFramesPerState, test::kFramesPerState);
    for (const std::size_t count : {1U, 63U, 100U, 236U}) {
      two.process(frames.first(count));
      frames = frames.subspan(count);
    }
  }
  EXPECT_EQ(whole, pieces);
  EXPECT_NE(whole, play(other, part));
}

TEST(DrillSound, ParametersMoveWithoutClicks) {
  // The largest slope of the steady sounds bounds that of a change between them. A click would exceed it.
  const auto step_of = [](const CuttingState& state) { return sound::largest_step(steady(state, kPure)); };
  const double steady_step = std::max(step_of(cortical_drill(1345)), step_of(free_drill(1400)));
  DrillSynth synth = make_synth(1, kPure);
  static_cast<void>(play(synth, free_drill(1400), 0.75));
  for (int i = 0; i < 10; ++i) {
    // Contact lost and found again within one state: the worst that a stream can bring.
    EXPECT_LT(sound::largest_step(play(synth, cortical_drill(1345), 0.1)), 1.25 * steady_step);
    EXPECT_LT(sound::largest_step(play(synth, free_drill(1400), 0.1)), 1.25 * steady_step);
  }
}

TEST(DrillSound, SeveralToolsAddUpByPower) {
  CuttingState second = cortical_drill(1300);
  second.author = AuthorId{2};
  const std::vector<CuttingState> both = {cortical_drill(1345), second};
  DrillSynth synth = make_synth();
  std::vector<float> samples(96000);
  for (std::size_t at = 0; at < samples.size(); at += 400) {
    synth.aim(sound_scene(both, 0));
    synth.process(std::span(samples).subspan(at, 400));
  }
  const double together_db = sound::rms_db(std::span(samples).last(48000));
  const double a = std::pow(10, sound::rms_db(steady(both[0])) / 10),
               b = std::pow(10, sound::rms_db(steady(both[1])) / 10);
  EXPECT_NEAR(together_db, 10 * std::log10(a + b), 0.7);
}

TEST(DrillSound, ChangedToolRunsDownBesideTheNewOne) {
  DrillSynth synth = make_synth();
  static_cast<void>(play(synth, free_drill(1400), 0.5));
  const std::vector<float> samples = play(synth, burr(20000, 0), 1.5);
  const double whine_hz = 20000 / 60.0;
  EXPECT_GT(sound::find_tone(std::span(samples).last(24000), kRate_hz, whine_hz - 5, whine_hz + 5).level_db, -60);
  const double mesh_hz = 48 * 1400 / 60.0;
  EXPECT_LT(sound::tone_db(std::span(samples).last(24000), kRate_hz, mesh_hz), -75) << "the drill stands still";
}

TEST(DrillSound, EverythingAtOnceStaysWithinFullScale) {
  std::vector<CuttingState> states;
  for (std::uint64_t author = 1; author <= 12; ++author) {
    CuttingState state = author % 2 ? cortical_drill(4000) : burr(60000, 1.9);
    state.author = AuthorId{author};
    state.force_physical_N = Vec3(0, 0, 500);
    state.torque_Nmm = 5000;
    state.feed_mm_per_s = 900;
    states.push_back(state);
  }
  DrillSynth synth = make_synth();
  std::vector<float> samples(96000);
  double loudest = 0;
  for (std::size_t at = 0; at < samples.size(); at += 400) {
    synth.aim(sound_scene(states, 0));
    synth.process(std::span(samples).subspan(at, 400));
    loudest = std::max(loudest, sound::peak(std::span(samples).subspan(at, 400)));
  }
  EXPECT_LT(loudest, 1.0);
  EXPECT_GT(loudest, 0.5) << "the limiter was needed";
}

TEST(DrillSound, NumbersOutOfRangeAreBounded) {
  CuttingState state = cortical_drill(1e9);
  state.density_g_cm3 = 1e9;
  state.torque_Nmm = -1e9;
  state.feed_mm_per_s = std::numeric_limits<double>::quiet_NaN();
  DrillSynth synth = make_synth();
  for (const float x : play(synth, state, 0.5)) ASSERT_TRUE(std::isfinite(x) && std::abs(x) <= 1.0F);
}

TEST(DrillSound, ProcessDoesNotAllocate) {
  const test::ScriptedDrilling script = test::scripted_drilling();
  std::vector<SoundScene> scenes;
  for (const CuttingState& state : script.states) scenes.push_back(sound_scene(std::span(&state, 1), 0));
  DrillSynth synth = make_synth();
  std::vector<float> frames(test::kFramesPerState);
  const test::AllocationCounter heap;
  for (const SoundScene& scene : scenes) {
    synth.aim(scene);
    synth.process(frames);
  }
  synth.reset();
  EXPECT_EQ(heap.count(), 0);
  delete static_cast<int*>(::operator new(sizeof(int)));
  EXPECT_GT(heap.count(), 0) << "the counter works";
}

TEST(Limiter, LeavesWhatFitsAndHoldsWhatDoesNot) {
  Limiter limiter;
  double loudest = 0, softest = 0;
  for (int block = 0; block < 400; ++block) {
    // A tone that jumps from a quarter of full scale to four times full scale and back.
    const double amplitude = block / 100 % 2 ? 4.0 : 0.25;
    StereoBlock frames;
    for (int i = 0; i < kBlockFrames; ++i) {
      const auto at = static_cast<std::size_t>(i);
      frames.left[at] =
          static_cast<float>(amplitude * std::sin(2 * std::numbers::pi * 440 * (block * kBlockFrames + i) / kRate_hz));
      frames.right[at] = 0.125F * frames.left[at];
    }
    limiter.process(frames);
    loudest = std::max(loudest, sound::peak(frames.left));
    for (std::size_t i = 0; i < kBlockFrames; ++i)
      ASSERT_NEAR(frames.right[i], 0.125F * frames.left[i], 1e-7F) << "both channels have one gain";
    if (block == 50) softest = sound::peak(frames.left);
  }
  EXPECT_LT(loudest, 1.0);
  EXPECT_GT(loudest, 0.9);
  EXPECT_NEAR(softest, 0.25, 0.01);
}

}  // namespace
}  // namespace osteon::audio
