// Presets: the files that come with Osteon, damaged ones, those made from a recording, and the program that makes them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "audio_client/presets/preset_file.hpp"
#include "audio_client/presets/recorded_preset.hpp"
#include "audio_client/synth/drill_synth.hpp"
#include "audio_client/synth/handpiece.hpp"
#include "audio_client/synth/voice.hpp"
#include "common/sound/gearbox.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/spectrum.hpp"
#include "common/sound/tones.hpp"
#include "common/sound/transients.hpp"
#include "common/sound/wav_file.hpp"
#include "common/tools/tool.hpp"
#include "common/tools/tool_file.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::audio {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

constexpr double kRecorded_hz = 44100;
constexpr sound::Gearbox kDrillGears;

const ToolModel& preset_of(const char* kind) { return *preset_for(builtin_presets(), "", kind); }

TEST(Preset, EachToolThatCutsHasOne) {
  for (const Tool& tool : builtin_tools()) {
    const ToolModel* model = preset_for(builtin_presets(), tool.name, kind_name(tool.kind));
    EXPECT_EQ(model != nullptr, tool.cuts() || tool.kind == ToolKind::pin || tool.kind == ToolKind::screw) << tool.name;
  }
  EXPECT_NE(preset_for(builtin_presets(), "suction", ""), nullptr);
}

TEST(Preset, ThoseOfOsteonHoldNoSamples) {
  for (const ToolModel& model : builtin_presets()) {
    EXPECT_TRUE(model.transients.empty()) << model.name;
    EXPECT_EQ(model.recorded_s, 0) << model.name;
  }
}

TEST(Preset, AWrittenFileGivesTheSameAgain) {
  for (ToolModel model : builtin_presets()) {
    model.recorded_s = 2.0;
    model.transients = {std::vector<float>(441, 0.25F), {0.5F, -1.0F, 0.0F}};
    const std::string yaml = to_yaml(model);
    const auto again = parse_preset(yaml, "a.yaml");
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(to_yaml(*again), yaml) << model.name;
    EXPECT_EQ(again->transients, model.transients);
    ASSERT_EQ(again->lines.size(), model.lines.size());
    for (std::size_t i = 0; i < model.lines.size(); ++i) {
      EXPECT_NEAR(again->lines[i].order, model.lines[i].order, 1e-5 * std::abs(model.lines[i].order));
      EXPECT_EQ(again->lines[i].source, model.lines[i].source);
    }
  }
}

TEST(Preset, ItsLinesComeFromTheGearTable) {
  std::vector<double> orders;
  for (const Line& line : preset_of("drill").lines) orders.push_back(line.order);
  for (const double order :
       {kDrillGears.motor(), kDrillGears.output_mesh(), kDrillGears.motor_mesh(),
        3.0 * sound::kCommutatorSegments * kDrillGears.motor(), kDrillGears.output_mesh() + kDrillGears.output_spin()})
    EXPECT_TRUE(std::ranges::any_of(orders, [&](double o) { return std::abs(o - order) < 1e-9; })) << order;
}

// A preset's text with one thing wrong, and what is said about it.
TEST(Preset, ADamagedOneIsOneSentence) {
  const std::string good = "name: a\ntools: [drill]\ndrive: rotation\nrated_rpm: 1000\n";
  ASSERT_TRUE(parse_preset(good, "a.yaml"));
  const std::string twenty_ms(588 * 2, 'A');  // base64 of 882 bytes, 441 samples
  ASSERT_TRUE(parse_preset(good + "recorded_s: 1\ntransients: [!!binary \"" + twenty_ms + "\"]\n", "a.yaml"));
  const std::vector<std::pair<std::string, std::vector<const char*>>> cases = {
      {"", {"must be lines such as"}},
      {"name: [", {"is not YAML", "line"}},
      {"tools: [drill]\ndrive: rotation\nrated_rpm: 9\n", {"\"name\" is missing"}},
      {"name: a\ndrive: rotation\nrated_rpm: 9\n", {"\"tools\" is missing"}},
      {"name: a\ntools: [drill]\ndrive: steam\nrated_rpm: 9\n", {"\"drive\" is \"steam\"", "rotation"}},
      {"name: a\ntools: [drill]\ndrive: rotation\n", {"\"rated_rpm\" is missing"}},
      {good + "colour: red\n", {"\"colour\" is not known", "choose one of", "motor"}},
      {good + "name: b\n", {"\"name\" is there twice"}},
      {good + "motor: {droop_rpm_per_Nmm: fast}\n", {"\"motor.droop_rpm_per_Nmm\" is \"fast\"", "write a number"}},
      {good + "motor: {most_Nmm: nan}\n", {"\"motor.most_Nmm\" is \"nan\""}},
      {good + "motor: 3\n", {"\"motor\" must be lines"}},
      {good + "lines: [{order: 1}]\n", {"\"lines[0].level_db\" is missing"}},
      {good + "lines: [{order: 1, of: motor, level_db: -9}]\n", {"\"lines[0].order\"", "only one"}},
      {good + "lines: [{of: motor-mesh, level_db: -9}]\n", {"\"lines[0].of\" is \"motor-mesh\"", "gears"}},
      {good + "lines: [{order: 1, level_db: 9}]\n", {"\"lines[0].level_db\" is \"9\"", "-200 to 0"}},
      {good + "lines: [{order: 1, source: bell, level_db: -9}]\n", {"\"lines[0].source\" is \"bell\"", "body"}},
      {good + "noise: [{hz: 900, db_per_hz: -80}, {hz: 400, db_per_hz: -80}]\n", {"\"noise\" must go from low"}},
      {good + "cancellous: {density_g_cm3: 2.5}\n", {"\"cancellous.density_g_cm3\" must be below"}},
      {good + "recorded_s: 1\ntransients: [!!binary \"" + twenty_ms + "AAAA\"]\n", {"\"transients\"", "20 ms"}},
      {good + "recorded_s: 0.1\ntransients: [!!binary \"" + twenty_ms + "\"]\n", {"\"transients\"", "a tenth"}},
      {good + "transients: [!!binary \"///\"]\n", {"\"transients\""}},
      {good + "perforation: {burst: [{hz: 1}]}\n", {"\"perforation.burst[0].hz\" is \"1\"", "20"}},
  };
  for (const auto& [text, says] : cases) {
    const auto model = parse_preset(text, "a.yaml");
    ASSERT_FALSE(model) << text;
    EXPECT_THAT(model.error().message, testing::StartsWith("a.yaml"));
    for (const char* words : says) EXPECT_THAT(model.error().message, HasSubstr(words));
    EXPECT_EQ(model.error().message.find('\n'), std::string::npos);
  }
}

// Bytes changed, lost, or put elsewhere at random: a preset is refused by one sentence, or it can be played.
TEST(Preset, DamageAtRandomIsASentenceOrASound) {
  std::mt19937 random(1);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  int refused = 0, played = 0;
  for (int round = 0; round < 200; ++round) {
    const ToolModel& model = builtin_presets()[below(builtin_presets().size())];
    std::string text = to_yaml(model);
    for (std::size_t change = 0; change <= below(3); ++change) {
      const std::size_t at = below(text.size());
      switch (below(8)) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, 1 + below(20));
          break;
        case 2:
          text.insert(at, std::string("0123456789-.e{}[]:&*!")[below(21)] + std::string());
          break;
        case 4:
          text.insert(at, text.substr(below(text.size()), below(40)));
          break;
        default: {
          const std::size_t digit = text.find_first_of("0123456789", at);
          if (digit < text.size()) text[digit] = "0123456789"[below(10)];
        }
      }
      if (text.empty()) text = "x";
    }
    const auto damaged = parse_preset(text, "a.yaml");
    if (!damaged) {
      ++refused;
      EXPECT_EQ(damaged.error().message.find('\n'), std::string::npos) << damaged.error().message;
      continue;
    }
    ++played;
    ToolSound tool;
    tool.tool = "drill-3.2";
    tool.rpm = 1000;
    tool.load = tool.hardness = tool.chips = 1;
    tool.torque_Nmm = 20;
    tool.cortex_mm = 2;
    Handpiece piece = make_handpiece(*damaged, nullptr, 48000);
    Voice voice;
    voice.start(piece, {}, 48000, tool, 1);
    tool.blows = 1;
    tool.blow_impulse_N_s = 3;
    for (int i = 0; i < 8; ++i) {
      voice.aim(tool);
      Block block{};
      voice.add_to(block);
      ASSERT_TRUE(std::ranges::all_of(block, [](float x) { return std::isfinite(x); })) << text;
    }
  }
  std::printf("  %d refused, %d played\n", refused, played);
  EXPECT_GT(refused, 40);
  EXPECT_GT(played, 15);
}

std::vector<float> play_tool(const ToolModel& model, const ToolSound& tool, double seconds) {
  DrillSynth synth;
  SynthParams params;
  params.voice.flutter = 0;
  params.presets = {model};
  synth.prepare(params);
  SoundScene scene;
  scene.count = 1;
  scene.tools[0] = tool;
  synth.aim(scene);
  std::vector<float> samples(48000);
  synth.process(samples);  // runs up
  samples.resize(static_cast<std::size_t>(48000 * seconds));
  synth.process(samples);
  return samples;
}

struct KnownLine {
  double order, level_db;
  LineSource source;
};

TEST(RecordedPreset, HasTheLinesAndTheNoiseOfTheRecordingAndPlaysThem) {
  const double rpm = 1425;
  const std::vector<KnownLine> lines = {{kDrillGears.output_mesh(), -32, LineSource::output_mesh},
                                        {kDrillGears.motor_mesh(), -28, LineSource::motor_mesh},
                                        {3 * sound::kCommutatorSegments * kDrillGears.motor(), -30, LineSource::motor},
                                        {61.7, -36, LineSource::body}};
  std::vector<float> recording = sound::white_noise(0.002, 4 * 44100, 1);
  for (const KnownLine& line : lines)
    recording = sound::added(recording, sound::tone(line.order * rpm / 60.0, std::pow(10.0, 0.05 * line.level_db),
                                                    recording.size(), kRecorded_hz));
  // The user says 1400: the gears' lines tell the speed.
  const auto made = recorded_preset(recording, 44100, preset_of("drill"), {.name = "mine", .tools = {}, .rpm = 1400});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_NEAR(made->model.rated_rpm, rpm, 0.002 * rpm);
  for (const KnownLine& line : lines) {
    const auto found = std::ranges::min_element(made->model.lines, {}, [&](const Line& l) {
      return std::abs(l.order * made->model.rated_rpm - line.order * rpm) + (l.teeth > 0 ? 1e6 : 0);
    });
    EXPECT_NEAR(found->order * made->model.rated_rpm, line.order * rpm, 60.0) << line.order;  // 1 Hz
    EXPECT_NEAR(found->level_db, line.level_db, 0.5) << line.order;
    EXPECT_EQ(found->source, line.source) << line.order;
  }

  ToolSound tool;
  tool.tool = "drill-3.2";
  tool.rpm = made->model.rated_rpm;
  const std::vector<float> played = play_tool(made->model, tool, 2.0);
  for (const KnownLine& line : lines)
    EXPECT_NEAR(
        sound::tone_db(played, 48000,
                       sound::find_tone(played, 48000, line.order * rpm / 60 - 8, line.order * rpm / 60 + 8).hz),
        line.level_db, 1.0)
        << line.order;
  // White noise of this RMS has 2 s^2 / rate in each hertz.
  const double density_db = 10 * std::log10(2 * 0.002 * 0.002 / kRecorded_hz);
  const sound::Spectrum spectrum = sound::power_spectrum(played, 48000);
  for (const double hz : {600.0, 2800.0, 4700.0, 8000.0})
    EXPECT_NEAR(sound::band_db(spectrum, 0.95 * hz, 1.05 * hz) - 10 * std::log10(0.1 * hz), density_db, 2.0) << hz;
}

TEST(RecordedPreset, LearnsWhatBoneChangesFromADrilling) {
  const test::ScriptedDrilling script = test::scripted_drilling();
  DrillSynth synth;
  synth.prepare({});
  const std::vector<float> recording = test::play(synth, script.states);
  const auto made = recorded_preset(recording, 48000, preset_of("drill"), {.name = "mine", .tools = {}, .rpm = 1400});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_THAT(made->text, AllOf(HasSubstr("reference  free"), HasSubstr("cortical"), HasSubstr("cancellous")));
  const Material &soft = made->model.cancellous, &hard = made->model.cortical;
  const auto of = [](const Material& m, LineSource s) { return m.change_db[static_cast<std::size_t>(s)]; };
  // The recording is of our own preset: it gives the changes of that preset, as far as noise lets them be measured.
  const ToolModel& truth = preset_of("drill");
  for (const LineSource source : {LineSource::motor, LineSource::motor_mesh, LineSource::output_mesh}) {
    EXPECT_NEAR(of(soft, source), of(truth.cancellous, source), 2.0) << source_name(source);
    EXPECT_NEAR(of(hard, source), of(truth.cortical, source), 2.0) << source_name(source);
  }
  for (const Material* material : {&soft, &hard})
    for (const double change : material->change_db) EXPECT_TRUE(change == 0 || std::abs(change) >= kChangeThreshold_db);
}

constexpr std::size_t kFirstBlow = 11025;  // sample of the recording
constexpr double kRinging_s = 0.08;

struct KnownMode {
  double hz, amplitude;
};

// Six blows, 0.6 s apart.
std::vector<float> recorded_blows(const std::vector<KnownMode>& modes) {
  std::vector<float> recording = sound::white_noise(1e-4, 4 * 44100, 2);
  for (int blow = 0; blow < 6; ++blow) {
    const std::size_t begin = kFirstBlow + static_cast<std::size_t>(blow) * 26460;
    for (std::size_t i = 0; begin + i < recording.size() && i < 26000; ++i) {
      const double t = static_cast<double>(i) / kRecorded_hz, fall = std::exp(-t / kRinging_s);
      double sum = 0;
      for (const KnownMode& mode : modes) sum += mode.amplitude * fall * std::sin(2 * std::numbers::pi * mode.hz * t);
      recording[begin + i] += static_cast<float>(sum);
    }
  }
  return recording;
}

TEST(RecordedPreset, OfBlowsHasTheirModesAndTheirImpacts) {
  const std::vector<KnownMode> modes = {{700.0, 0.3}, {1900.0, 0.2}};
  const std::vector<float> recording = recorded_blows(modes);
  const auto made = recorded_preset(recording, 44100, preset_of("broach"), {.name = "mine", .tools = {}});
  ASSERT_TRUE(made) << made.error().message;
  for (const KnownMode& known : modes) {
    const auto mode =
        std::ranges::min_element(made->model.blow.modes, {}, [&](const Mode& m) { return std::abs(m.hz - known.hz); });
    EXPECT_NEAR(mode->hz, known.hz, 10.0);
    EXPECT_NEAR(mode->decay_s, kRinging_s, 0.25 * kRinging_s);
    EXPECT_NEAR(mode->level_db, 20 * std::log10(known.amplitude), 2.5);
  }
  std::size_t stored = 0;
  for (const std::vector<float>& transient : made->model.transients) {
    EXPECT_LE(transient.size(), 441U);
    stored += transient.size();
  }
  EXPECT_GT(made->model.transients.size(), 0U);
  EXPECT_LE(static_cast<double>(stored), 0.1 * 4 * 22050);
  ASSERT_TRUE(parse_preset(to_yaml(made->model), "a.yaml"))
      << parse_preset(to_yaml(made->model), "a.yaml").error().message;
}

// Clicks of 1 ms in silence.
TEST(RecordedPreset, BlowsThatDoNotRingAreSaid) {
  std::vector<float> recording(4 * 44100);
  const std::vector<float> click = sound::white_noise(0.3, 44, 3);
  for (std::size_t blow = 0; blow < 6; ++blow)
    for (std::size_t i = 0; i < click.size(); ++i) recording[kFirstBlow + blow * 26460 + i] += click[i];
  const auto made = recorded_preset(recording, 44100, preset_of("broach"), {.name = "mine", .tools = {}});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->model.blow.modes.size(), 0U);
  EXPECT_THAT(made->text, AllOf(HasSubstr("note       nothing rings"), HasSubstr("--tool")));
  const auto ringing =
      recorded_preset(recorded_blows({{700.0, 0.3}}), 44100, preset_of("broach"), {.name = "mine", .tools = {}});
  ASSERT_TRUE(ringing) << ringing.error().message;
  EXPECT_THAT(ringing->text, testing::Not(HasSubstr("note")));
}

// The recorded blow has the modes in it. If they began with it, it would sound twice: a transient begins 1 ms before
// its impact, which is a whole number of periods of these modes, so that they would add up to 6 dB more.
TEST(RecordedPreset, ABlowIsAsLoudAsItsRecordingFromItsBeginning) {
  const std::vector<float> recording = recorded_blows({{1000.0, 0.15}, {2000.0, 0.1}});
  const auto made = recorded_preset(recording, 44100, preset_of("broach"), {.name = "mine", .tools = {}});
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_GT(made->model.transients.size(), 0U);
  const Handpiece piece = make_handpiece(made->model, nullptr, 48000);
  ToolSound tool;
  Voice voice;
  voice.start(piece, {}, 48000, tool, 1);
  tool.blows = 1;
  tool.blow_impulse_N_s = made->model.blow.impulse_N_s;
  voice.aim(tool);
  std::vector<float> played;
  while (played.size() < 9600) {
    Block block{};
    voice.add_to(block);
    played.insert(played.end(), block.begin(), block.end());
  }
  const auto level_db = [](const std::vector<float>& samples, double rate_hz, double from_s, double to_s) {
    const auto from = static_cast<std::size_t>(from_s * rate_hz), to = static_cast<std::size_t>(to_s * rate_hz);
    return sound::rms_db(std::span(samples).subspan(from, to - from));
  };
  const double begin_s = static_cast<double>(kFirstBlow) / kRecorded_hz - sound::kTransientLead_s;
  EXPECT_NEAR(level_db(played, 48000, 0, 0.02), level_db(recording, kRecorded_hz, begin_s, begin_s + 0.02), 2.0);
  // Then the modes ring alone.
  EXPECT_NEAR(level_db(played, 48000, 0.03, 0.1), level_db(recording, kRecorded_hz, begin_s + 0.03, begin_s + 0.1),
              4.0);
}

class PresetProgram : public testing::Test {
 protected:
  PresetProgram() {
    std::vector<float> samples = sound::white_noise(0.01, 88200, 1);
    EXPECT_TRUE(sound::write_wav(wav(), sound::added(samples, sound::tone(1120, 0.2, 88200, 44100)), 44100));
  }
  [[nodiscard]] std::string wav() const { return path("drill.wav"); }
  [[nodiscard]] std::string path(const char* name) const { return (temp_ / name).string(); }
  [[nodiscard]] static test::RunResult run(const std::vector<std::string>& arguments) {
    return test::run(test::program("osteon-audio"), arguments);
  }

  test::TempDir temp_;
};

TEST_F(PresetProgram, OneCommandMakesAPresetThatCanBeRead) {
  const test::RunResult made = run({"preset", wav(), "--out", path("mine.yaml")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("lines"), HasSubstr("noise"), HasSubstr("mine.yaml")));
  const auto presets = load_presets(path("mine.yaml"));
  ASSERT_TRUE(presets) << presets.error().message;
  EXPECT_EQ(presets->front().name, "mine");
  EXPECT_EQ(presets->front().tools, preset_of("drill").tools);
  ASSERT_EQ(run({"preset", wav(), "--out", path("again.yaml"), "--name", "mine"}).exit_code, 0);
  EXPECT_EQ(test::content(temp_ / "mine.yaml"), test::content(temp_ / "again.yaml"));
  // A folder has all of them, in the order of their names.
  const auto both = load_presets(temp_.path());
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_EQ(both->size(), 2U);
}

TEST_F(PresetProgram, WrongUseIsOneSentenceEach) {
  const std::string good = "name: a\ntools: [drill]\ndrive: rotation\nrated_rpm: 1000\n";
  const auto put = [&](const char* name, const std::string& text) {
    std::ofstream(temp_ / name) << text;
    return path(name);
  };
  fs::create_directory(temp_ / "empty");
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  const auto played = [&](const std::string& preset) {
    return std::vector<std::string>{"--server",  "127.0.0.1:1", "--plain",  "--output", "none",
                                    "--timeout", "0",           "--preset", preset};
  };
  const std::vector<std::pair<std::vector<std::string>, std::vector<const char*>>> cases = {
      {{"preset", wav()}, {"--out"}},
      {{"preset", path("nothing.wav"), "--out", path("b")}, {"nothing.wav", "give the path"}},
      {{"preset", wav(), "--out", wav()}, {"drill.wav would lose what is read"}},
      {{"preset", wav(), "--out", path("pipe")}, {"pipe: it is a device or a pipe"}},
      {{"preset", wav(), "--out", path("b"), "--tool", "spoon"}, {"--tool \"spoon\"", "round-burr"}},
      {{"preset", wav(), "--out", path("b"), "--tool", "guide-1"}, {"--tool \"guide-1\""}},
      {{"preset", wav(), "--out", path("b"), "--rpm", "nan"}, {"--rpm", "nan"}},
      {{"preset", wav(), "--out", path("b"), "--tool", "broach"}, {"drill.wav", "no blow"}},
      {played(path("nothing.yaml")), {"nothing.yaml", "give a YAML file"}},
      {played(path("empty")), {"empty has no preset"}},
      {played(path("pipe")), {"there is no preset", "pipe"}},
      {played(put("damaged.yaml", good + "motor: {most_Nmm: -3}\n")), {"damaged.yaml", "\"motor.most_Nmm\" is \"-3\""}},
      {played(put("spoon.yaml", "name: a\ntools: [spoon]\ndrive: rotation\nrated_rpm: 9\n")),
       {"spoon.yaml", "\"tools\""}},
  };
  const std::string recorded = test::content(temp_ / "drill.wav");
  for (const auto& [arguments, says] : cases) {
    const test::RunResult result = run(arguments);
    EXPECT_EQ(result.exit_code, 1) << says.front();
    for (const char* words : says) EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
  }
  EXPECT_EQ(test::content(temp_ / "drill.wav"), recorded);
}

}  // namespace
}  // namespace osteon::audio
