// What 8.5.4 says of the sound of drilling, and what the other tools do, measured on the rendered sound.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <span>
#include <string_view>
#include <vector>

#include "audio_client/presets/preset_file.hpp"
#include "audio_client/synth/drill_synth.hpp"
#include "audio_client/synth/resonances.hpp"
#include "audio_client/synth/spindle_motor.hpp"
#include "common/sound/gearbox.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/resample.hpp"
#include "common/sound/spectrum.hpp"
#include "common/sound/tones.hpp"
#include "common/sound/transients.hpp"
#include "common/sound/wavelet_packets.hpp"
#include "common/tools/tool.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/unit/audio_client/played_tools.hpp"

namespace osteon::audio {
namespace {

using test::cancellous_tool;
using test::cortical_tool;
using test::cutting_tool;
using test::free_tool;
using test::kLinesAlone;
using test::kRate_hz;
using test::kThrough_s;
using test::played_drilling;
using test::Player;
using test::sound_part;
using test::steadily;

constexpr sound::Gearbox kGears;

// 8.6.3: 3 dB to 5 dB are an obvious difference in loudness.
TEST(NiuDrilling, EnergyRisesFromFreeToPerforationWhichIsTheLoudestMoment) {
  const std::vector<float> samples = played_drilling();
  const double free_db = sound::rms_db(sound_part(samples, 0.75, 0.7)),
               cancellous_db = sound::rms_db(sound_part(samples, 2.0, 0.9)),
               cortical_db = sound::rms_db(sound_part(samples, 4.0, 1.9)),
               perforation_db = sound::rms_db(sound_part(samples, kThrough_s, 0.1));
  std::printf("  free %.1f, cancellous %.1f, cortical %.1f, perforation %.1f dB\n", free_db, cancellous_db, cortical_db,
              perforation_db);
  EXPECT_GT(cancellous_db, free_db + 3.0);
  EXPECT_GT(cortical_db, cancellous_db + 3.0);
  EXPECT_GT(perforation_db, cortical_db + 3.0);

  const std::vector<double> levels = sound::block_levels_db(samples, 2400);
  const auto loudest = std::ranges::max_element(levels) - levels.begin();
  EXPECT_NEAR(0.05 * static_cast<double>(loudest), kThrough_s + 0.05, 0.1);
}

TEST(NiuDrilling, PerforationIsABurstNear200Hz) {
  const std::vector<float> samples = played_drilling();
  const sound::Spectrum burst = sound::power_spectrum(sound_part(samples, kThrough_s + 0.005, 0.085), kRate_hz, 4096);
  EXPECT_NEAR(sound::strongest_peaks(burst, 1, 50.0).front().hz, 200.0, 30.0);
  const sound::Spectrum before = sound::power_spectrum(sound_part(samples, 5.0, 0.9), kRate_hz);
  EXPECT_GT(sound::band_db(burst, 100, 300), sound::band_db(before, 100, 300) + 10.0);
  // The burst is heard up to the band of 689 to 1378 Hz.
  EXPECT_GT(sound::band_db(burst, 0, 1378), sound::band_db(before, 0, 1378) + 5.0);
}

TEST(NiuDrilling, TheStrongestLineIsTheMotorsInCortexAndTheGearsInCancellous) {
  const auto strongest_order = [](const ToolSound& tool) {
    const sound::Spectrum spectrum = sound::power_spectrum(steadily(tool), kRate_hz, 8192);
    return sound::strongest_peaks(spectrum, 1, 50.0).front().hz * 60.0 / tool.rpm;
  };
  const double motor = 3 * sound::kCommutatorSegments * kGears.motor();
  EXPECT_NEAR(strongest_order(free_tool()), motor, 0.5);
  EXPECT_NEAR(strongest_order(cortical_tool()), motor, 0.5);
  EXPECT_NEAR(strongest_order(cancellous_tool()), kGears.motor_mesh(), 0.5);
}

TEST(NiuDrilling, TheLowBandRisesFromFreeToCortical) {
  const auto low_db = [](const ToolSound& tool) {
    return sound::band_db(sound::power_spectrum(steadily(tool), kRate_hz), 0, 400);
  };
  const double free_db = low_db(free_tool()), cancellous_db = low_db(cancellous_tool()),
               cortical_db = low_db(cortical_tool());
  std::printf("  0-400 Hz: free %.1f, cancellous %.1f, cortical %.1f dB\n", free_db, cancellous_db, cortical_db);
  EXPECT_GT(cancellous_db, free_db + 3.0);
  EXPECT_GT(cortical_db, cancellous_db + 3.0);
}

TEST(NiuDrilling, TheLowerHalfOfTheFrequenciesHasMoreEnergy) {
  const std::vector<float> samples = played_drilling();
  for (const double from_s : {0.75, 2.0, 4.0, kThrough_s}) {
    const std::vector<float> low = sound::resampled(sound_part(samples, from_s, 0.5), kRate_hz, 22050);
    const std::vector<double> shares = sound::energy_shares(sound::wavelet_packets(low, 22050, 1), 1);
    std::printf("  from %.2f s: A1 %.2f, D1 %.2f\n", from_s, shares[0], shares[1]);
    EXPECT_GT(shares[0], 1.5 * shares[1]) << from_s;
  }
}

// 5500 Hz fall to 5400 Hz, and 4015 and 1120 Hz follow. No further state says so: the motor itself slows.
TEST(SpindlePhase, ALoadShiftsAllPartialsByOneRatio) {
  Player player(1, kLinesAlone);
  static_cast<void>(player.play(free_tool(), 0.75));
  ToolSound loaded = cortical_tool();
  loaded.rpm = 1400;
  const double droop_rpm_per_Nmm = 0.7;  // of common/mechanics, at the spindle
  loaded.torque_Nmm = 1400 * (100.0 / 5500.0) / droop_rpm_per_Nmm;
  static_cast<void>(player.play(loaded, 1.0 / 120.0));
  static_cast<void>(player.unaimed(0.2));  // ten time constants
  const std::vector<float> samples = player.unaimed(1.0);
  for (const double order : {kGears.output_mesh(), 2 * kGears.output_mesh(), kGears.motor_mesh(),
                             3 * sound::kCommutatorSegments * kGears.motor()}) {
    const double free_hz = order * 1400 / 60.0;
    const double hz = sound::find_tone(samples, kRate_hz, 0.97 * free_hz, free_hz).hz;
    EXPECT_NEAR(hz / free_hz, 5400.0 / 5500.0, 5e-4) << order;
  }
}

// Turns of the line at `hz` in the middle of the samples.
double turns_of(const std::vector<float>& samples, double hz) {
  const double size = static_cast<double>(samples.size());
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double at = static_cast<double>(i) - 0.5 * size;
    const double window = 0.5 + 0.5 * std::cos(2.0 * std::numbers::pi * at / size);
    sum += window * static_cast<double>(samples[i]) * std::polar(1.0, -2.0 * std::numbers::pi * hz * at / kRate_hz);
  }
  return std::arg(sum) / (2.0 * std::numbers::pi);
}

// With one phase for all, the second harmonic of the mesh has turned exactly twice as far as the mesh, whatever the
// speed has been meanwhile.
TEST(SpindlePhase, PartialsStayTogetherThroughAChangeOfSpeed) {
  Player player(1, kLinesAlone);
  const auto ahead = [&](const ToolSound& tool) {
    static_cast<void>(player.play(tool, 1.0));
    const std::vector<float> samples = player.play(tool, 0.5);
    const double mesh_hz = kGears.output_mesh() * tool.rpm / 60.0;
    const double turns = turns_of(samples, 2.0 * mesh_hz) - 2.0 * turns_of(samples, mesh_hz);
    return turns - std::floor(turns);
  };
  const double first = ahead(free_tool());
  for (const ToolSound& tool : {cortical_tool(), cancellous_tool(), free_tool()}) {
    const double moved = ahead(tool) - first;
    EXPECT_NEAR(moved - std::round(moved), 0.0, 0.005) << tool.rpm;
  }
}

// Two roads to one speed: the haptic client's spindle, a thousand times a second, and this one, from its states.
TEST(SpindleMotor, FollowsTheSpindleThroughLoadStallAndRecovery) {
  const SpindleParams params{.full_rpm = 1400, .run_up_s = 0.3};
  const ToolModel* drill = preset_for(builtin_presets(), "", "drill");
  ASSERT_NE(drill, nullptr);
  SpindleMotor motor;
  motor.start(at_spindle(drill->motor, drill->rated_rpm), drill->motor.run_down_s);
  Spindle truth;
  bool stalled = false;
  double worst_rpm = 0;
  for (int ms = 0; ms < 3000; ++ms) {
    const double torque = ms < 1000 ? 0 : ms < 1500 ? 100 : ms < 2000 ? 600 : ms < 2500 ? 20 : 0;
    truth.step(params, 1400, torque, 0.001);
    stalled = stalled || truth.stalled;
    if (ms % 8 == 0) motor.aim(truth.rpm, torque);
    motor.step(0.001);
    worst_rpm = std::max(worst_rpm, std::abs(motor.rpm() - truth.rpm));
    if (ms == 1400) {
      EXPECT_NEAR(motor.rpm(), 1400 - 0.7 * 100, 2.0);
    }
    if (ms == 1950) {
      EXPECT_EQ(motor.rpm(), 0.0);
      EXPECT_TRUE(motor.stalled());
    }
    if (ms == 2450) {
      EXPECT_NEAR(motor.rpm(), 1400 - 0.7 * 20, 2.0) << "it has recovered";
    }
  }
  EXPECT_TRUE(stalled);
  std::printf("  largest difference of the speeds %.0f rpm\n", worst_rpm);
  // A state is up to 8 ms old, while a stall takes 0.1 s from 1400 rpm to rest.
  EXPECT_LT(worst_rpm, 1400 * 0.12);
}

// No second state comes, because nothing changes.
TEST(SpindleMotor, ASingleStateUnderLoadIsItsSpeed) {
  const ToolModel* drill = preset_for(builtin_presets(), "", "drill");
  ASSERT_NE(drill, nullptr);
  SpindleMotor motor;
  motor.start(at_spindle(drill->motor, drill->rated_rpm), drill->motor.run_down_s);
  motor.aim(1200, 27);
  for (int ms = 0; ms < 2000; ++ms) motor.step(0.001);
  EXPECT_NEAR(motor.rpm(), 1200.0, 1.0);
}

TEST(SpindleMotor, AStalledDrillIsSilentAndComesBack) {
  Player player(1, kLinesAlone);
  static_cast<void>(player.play(free_tool(), 0.75));
  ToolSound stalled = cortical_tool();
  stalled.rpm = 0;
  stalled.torque_Nmm = 600;
  static_cast<void>(player.play(stalled, 0.5));
  EXPECT_FALSE(player.synth().silent()) << "it is driven";
  EXPECT_LT(sound::rms_db(player.play(stalled, 0.25)), -80.0);
  static_cast<void>(player.play(free_tool(), 0.5));
  const double mesh_hz = kGears.output_mesh() * 1400 / 60.0;
  EXPECT_NEAR(sound::find_tone(player.play(free_tool(), 1.0), kRate_hz, mesh_hz - 20, mesh_hz + 20).hz, mesh_hz, 0.05);
}

TEST(MaterialTable, ReachesTheTableAtItsMaterialsAndLeavesSmallChangesOut) {
  ToolModel model = *preset_for(builtin_presets(), "", "drill");
  model.cancellous.change_db = {1.0, 5.0, 9.0, -2.9, -4.0, 2.0};
  model.cortical.change_db = {3.0, 18.0, 16.0, 13.0, 6.0, 2.99};
  const auto db = [&](double load, double density, LineSource source) {
    const Gains gains = material_gains(model, load, density / 1.9, 0.0);
    return 20.0 * std::log10(gains.source[static_cast<std::size_t>(source)]);
  };
  EXPECT_NEAR(db(0.45, 0.3, LineSource::motor), 5.0, 1e-9);
  EXPECT_NEAR(db(0.45, 0.3, LineSource::teeth), -4.0, 1e-9);
  EXPECT_NEAR(db(0.45, 0.3, LineSource::output_mesh), 0.0, 1e-9) << "2.9 dB are below the threshold";
  EXPECT_NEAR(db(1.09, 1.9, LineSource::shaft), 3.0, 1e-9);
  EXPECT_NEAR(db(1.09, 1.9, LineSource::body), 0.0, 1e-9);
  // Midway between the densities, at the load midway, the dB are midway.
  EXPECT_NEAR(db(0.77, 1.1, LineSource::motor), 11.5, 1e-9);
  EXPECT_NEAR(db(0.0, 1.9, LineSource::motor), 0.0, 1e-9) << "running free";
}

TEST(ToolTeeth, AreHeardAtTheirRate) {
  for (const auto& [name, rpm] : {std::pair{"reamer-sphere", 250.0}, std::pair{"burr-round-5", 20000.0}}) {
    const auto tool = find_tool(name);
    ASSERT_TRUE(tool);
    const double hz = tool->teeth * rpm / 60.0;
    Player player(1, kLinesAlone);
    const ToolSound cutting = cutting_tool(tool->name, rpm);
    static_cast<void>(player.play(cutting, 0.75));
    const std::vector<float> cut = player.play(cutting, 1.0);
    EXPECT_NEAR(sound::find_tone(cut, kRate_hz, 0.99 * hz, 1.01 * hz).hz, hz, 0.1) << name;
    ToolSound free = cutting;
    free.load = free.hardness = free.chips = 0;
    static_cast<void>(player.play(free, 1.0));
    EXPECT_GT(sound::tone_db(cut, kRate_hz, hz), sound::tone_db(player.play(free, 1.0), kRate_hz, hz) + 20.0) << name;
  }
}

// A preset without lines and steady noise: what the cut itself sounds like.
ToolModel cut_alone(std::string_view kind) {
  ToolModel model = *preset_for(builtin_presets(), "", kind);
  model.lines.clear();
  model.noise.clear();
  return model;
}

TEST(SawSound, HasSidebandsAtTheStrokeRate) {
  const double stroke_hz = 200.0;
  for (const char* name : {"saw-oscillating-1", "saw-reciprocating"}) {
    Player player(1, kLinesAlone);
    const ToolSound saw = cutting_tool(name, 60 * stroke_hz);
    static_cast<void>(player.play(saw, 0.75));
    const std::vector<float> samples = player.play(saw, 1.0);
    const double motor_hz = stroke_hz * (name[4] == 'o' ? 12 : 9);
    for (const int side : {-1, 1}) {
      const double hz = motor_hz + side * stroke_hz;
      EXPECT_GT(sound::tone_db(samples, kRate_hz, hz), sound::tone_db(samples, kRate_hz, hz + 90.0) + 30.0) << name;
    }
  }
}

// The noise of the teeth swells in each direction of a stroke: its power has lines at one and two strokes a period.
TEST(SawSound, TheCutSwellsWithTheStroke) {
  const double stroke_hz = 200.0;
  Player player(1, {.flutter = 0}, {cut_alone("oscillating-saw")});
  const ToolSound saw = cutting_tool("saw-oscillating-1", 60 * stroke_hz);
  static_cast<void>(player.play(saw, 0.75));
  std::vector<float> power = player.play(saw, 4.0);
  for (float& x : power) x *= x;
  const double once_db = sound::tone_db(power, kRate_hz, stroke_hz),
               twice_db = sound::tone_db(power, kRate_hz, 2 * stroke_hz);
  double beside_db = -200;
  for (const double off : {-130.0, -70.0, 70.0, 130.0})
    beside_db = std::max(beside_db, sound::tone_db(power, kRate_hz, 2 * stroke_hz + off));
  std::printf("  once %.1f, twice %.1f, beside at most %.1f dB\n", once_db, twice_db, beside_db);
  EXPECT_GT(twice_db, beside_db + 12.0);
  EXPECT_GT(once_db, beside_db + 6.0);
}

TEST(SawSound, TheBladeRingsAtItsModes) {
  // k^2 / (2 pi L^2) sqrt(E / (12 rho)) h with k = 1.875 and 4.694, E = 200 GPa, 7850 kg/m3, 90 mm and 1.19 mm.
  EXPECT_NEAR(beam_mode_hz(0, 90.0, 1.19), 119.8, 0.3);
  EXPECT_NEAR(beam_mode_hz(1, 90.0, 1.19), 750.7, 1.5);
  ToolModel model = cut_alone("oscillating-saw");
  model.chips.level_db = -200;
  model.chips.depth = 0;
  Player player(1, {}, {model});
  const ToolSound saw = cutting_tool("saw-oscillating-1", 12000);
  static_cast<void>(player.play(saw, 0.75));
  const sound::Spectrum spectrum = sound::power_spectrum(player.play(saw, 4.0), kRate_hz);
  for (const int mode : {1, 2, 3}) {
    const double hz = beam_mode_hz(mode, 90.0, 1.19), width = 0.05 * hz;
    EXPECT_GT(sound::band_db(spectrum, hz - width, hz + width),
              sound::band_db(spectrum, 1.3 * hz - width, 1.3 * hz + width) + 6.0)
        << mode;
  }
}

TEST(BoneResonance, FollowsTheThicknessOfTheCortex) {
  // 10.2158 / (2 pi R^2) sqrt(E / (12 rho (1 - nu^2))) h with 17 GPa, 1900 kg/m3 and nu = 0.3.
  EXPECT_NEAR(plate_mode_hz(1.0, 50.0), 588.7, 1.0);
  EXPECT_NEAR(plate_mode_hz(4.0, 50.0) / plate_mode_hz(1.0, 50.0), 4.0, 1e-9);
  ToolModel model = cut_alone("drill");
  model.chips.level_db = -200;
  double before_hz = 0;
  for (const double cortex_mm : {1.5, 3.0, 6.0}) {
    Player player(1, {}, {model});
    ToolSound tool = cutting_tool("drill-3.2", 1400);
    tool.cortex_mm = cortex_mm;
    static_cast<void>(player.play(tool, 0.75));
    const double hz = plate_mode_hz(cortex_mm, model.plate.radius_mm);
    const double heard_hz =
        sound::centroid_hz(sound::power_spectrum(player.play(tool, 4.0), kRate_hz), 0.7 * hz, 1.4 * hz);
    EXPECT_NEAR(heard_hz, hz, 0.05 * hz) << cortex_mm;
    EXPECT_GT(heard_hz, 1.8 * before_hz);
    before_hz = heard_hz;
  }
  // Where the thickness is not known, nothing rings.
  Player player(1, {}, {model});
  static_cast<void>(player.play(cutting_tool("drill-3.2", 1400), 0.5));
  EXPECT_LT(sound::rms_db(player.play(cutting_tool("drill-3.2", 1400), 0.5)), -100.0);
}

ToolSound broach(std::uint32_t blows, double seated, double impulse_N_s = 2.8) {
  ToolSound tool;
  tool.author = 1;
  tool.tool = "broach-1";
  tool.rpm = 60;
  tool.blows = blows;
  tool.seated = seated;
  tool.blow_impulse_N_s = impulse_N_s;
  return tool;
}

TEST(BroachSound, EachBlowIsOneImpact) {
  Player player;
  std::vector<float> all = player.play(broach(3, 0.2), 0.5);  // three blows before anybody listened
  EXPECT_EQ(sound::peak(all), 0.0);
  for (std::uint32_t blow = 4; blow < 9; ++blow) {
    const std::vector<float> part = player.play(broach(blow, 0.2), 0.6);
    all.insert(all.end(), part.begin(), part.end());
  }
  const std::vector<std::size_t> impacts = sound::impacts(all, kRate_hz);
  ASSERT_EQ(impacts.size(), 5U);
  for (std::size_t i = 0; i < impacts.size(); ++i)
    EXPECT_NEAR(static_cast<double>(impacts[i]) / kRate_hz, 0.5 + 0.6 * static_cast<double>(i), 0.01);
  static_cast<void>(player.play(broach(8, 0.2), 1.0));
  EXPECT_EQ(sound::peak(player.play(broach(8, 0.2), 0.2)), 0.0) << "it has died away";
  EXPECT_TRUE(player.synth().silent());
}

TEST(BroachSound, AStrongerBlowIsLouderInProportion) {
  const auto level_db = [](double impulse_N_s) {
    Player player(1, {.noise = 0});
    static_cast<void>(player.play(broach(0, 0.5), 0.1));
    return sound::rms_db(player.play(broach(1, 0.5, impulse_N_s), 0.3));
  };
  EXPECT_NEAR(level_db(2.8) - level_db(1.4), 20 * std::log10(2.0), 0.05);
  EXPECT_LT(level_db(0.0), -150.0);
}

TEST(BroachSound, ModesRiseWithSeating) {
  const double loose_hz = 480.0, rise = 0.4;  // of the preset
  for (const double seated : {0.0, 0.5, 1.0}) {
    Player player(1, {.noise = 0});
    static_cast<void>(player.play(broach(0, seated), 0.1));
    const std::vector<float> ring = player.play(broach(1, seated), 0.3);
    // Stiffness of the contact in proportion to the seating.
    const double expected_hz = loose_hz * std::sqrt(1.0 + ((1 + rise) * (1 + rise) - 1.0) * seated);
    const double hz = sound::find_tone(std::span(ring).subspan(480), kRate_hz, 400, 800).hz;
    EXPECT_NEAR(hz, expected_hz, 0.01 * expected_hz) << seated;
  }
}

std::vector<ToolSound> one_of_each() {
  std::vector<ToolSound> tools;
  for (const Tool& tool : builtin_tools())
    if (tool.cuts()) {
      ToolSound one = cutting_tool(tool.name, tool.spindle_rpm);
      one.cortex_mm = 3;
      one.blow_impulse_N_s = 2.8;
      tools.push_back(one);
    }
  return tools;
}

TEST(ToolSounds, EqualSeedsSoundAlikeAndOthersDoNot) {
  for (ToolSound tool : one_of_each()) {
    Player one(7), two(7), other(8);
    std::vector<std::vector<float>> heard;
    for (Player* player : {&one, &two, &other}) {
      tool.blows = 0;
      heard.push_back(player->play(tool, 0.1));
      tool.blows = 1;
      const std::vector<float> more = player->play(tool, 0.2);
      heard.back().insert(heard.back().end(), more.begin(), more.end());
    }
    EXPECT_GT(sound::peak(heard[0]), 1e-4) << tool.tool;
    EXPECT_EQ(heard[0], heard[1]) << tool.tool;
    EXPECT_NE(heard[0], heard[2]) << tool.tool;
  }
}

TEST(ToolSounds, AreMadeWithoutAllocation) {
  const std::vector<ToolSound> tools = one_of_each();
  DrillSynth synth;
  synth.prepare({});
  std::vector<float> frames(test::kFramesPerState);
  SoundScene scene;
  const test::AllocationCounter heap;
  for (const ToolSound& tool : tools)
    for (std::uint32_t state = 0; state < 60; ++state) {
      scene.count = 1;
      scene.tools[0] = tool;
      scene.tools[0].blows = state / 20;
      scene.tools[0].suction = state > 30;
      if (state > 40) scene.tools[0].load = scene.tools[0].hardness = scene.tools[0].chips = 0;  // breaks through
      synth.aim(scene);
      synth.process(frames);
    }
  synth.reset();
  EXPECT_EQ(heap.count(), 0);
}

// A tool that another room's box has, and this program does not: it sounds by its kind of hand piece.
TEST(ToolSounds, AnUnknownToolSoundsLikeADrillOrABurr) {
  ToolSound unknown = cortical_tool();
  const std::vector<float> known = steadily(unknown);
  unknown.tool = "drill-of-tomorrow";
  EXPECT_NEAR(sound::rms_db(steadily(unknown)), sound::rms_db(known), 0.5);
  unknown.handpiece = HandpieceKind::direct_burr;
  unknown.rpm = 40000;
  const std::vector<float> burr = steadily(unknown);
  EXPECT_GT(sound::tone_db(burr, kRate_hz, 40000 / 60.0), -45.0);
}

}  // namespace
}  // namespace osteon::audio
