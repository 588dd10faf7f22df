// osteon-audio analyse: states of a drilling that our own synthesis made and of real recordings, the files that it
// writes, and what it says to wrong use.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "audio_client/analysis/analysis.hpp"
#include "audio_client/analysis/analysis_report.hpp"
#include "audio_client/synth/drill_synth.hpp"
#include "common/sound/levels.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::audio {
namespace {

namespace fs = std::filesystem;
using sound::DrillingState;

sound::WavSound scripted_recording(test::ScriptedDrilling& script) {
  script = test::scripted_drilling();
  DrillSynth synth;
  synth.prepare({});
  sound::WavSound recording;
  recording.rate_hz = static_cast<int>(test::kRate_hz);
  recording.samples = test::play(synth, script.states);
  return recording;
}

std::string states_in_words(const SoundAnalysis& analysis) {
  std::ostringstream text;
  for (const sound::StateSpan& span : analysis.states)
    text << sound::name(span.state) << ' ' << span.from_s << '-' << span.to_s << " s at " << span.level_db << " dB, ";
  return text.str();
}

DrillingState state_at(const SoundAnalysis& analysis, double time_s) {
  for (const sound::StateSpan& span : analysis.states)
    if (time_s < span.to_s) return span.state;
  return analysis.states.back().state;
}

TEST(SoundAnalysis, TheSynthesisIsHeardAsWhatItPlays) {
  test::ScriptedDrilling script;
  const sound::WavSound recording = scripted_recording(script);
  const SoundAnalysis analysis = analyse(recording, {});
  SCOPED_TRACE(states_in_words(analysis));
  const std::vector<std::pair<std::string, DrillingState>> expected = {{"free", DrillingState::free},
                                                                       {"cortical", DrillingState::cortical},
                                                                       {"cancellous", DrillingState::cancellous},
                                                                       {"far cortical", DrillingState::cortical},
                                                                       {"free again", DrillingState::free}};
  for (const auto& [part_name, state] : expected) {
    const auto part = std::ranges::find(script.parts, part_name, &test::ScriptedPart::name);
    ASSERT_NE(part, script.parts.end()) << part_name;
    EXPECT_EQ(sound::name(state_at(analysis, 0.5 * (part->from_s + part->to_s))), sound::name(state)) << part_name;
  }
  EXPECT_EQ(analysis.states.front().state, DrillingState::before);
  EXPECT_EQ(analysis.states.back().state, DrillingState::after);
  // The hand piece's own lines, at the speed of the script.
  ASSERT_TRUE(analysis.difference);
  EXPECT_EQ(analysis.difference->samples.size(), analysis.samples.size());
}

TEST(SoundAnalysis, BandsSumToTheRecording) {
  test::ScriptedDrilling script;
  const SoundAnalysis analysis = analyse(scripted_recording(script), {});
  std::vector<float> sum(analysis.samples.size(), 0.0F);
  for (const BandInTime& band : analysis.bands)
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += band.samples[i];
  for (std::size_t i = 0; i < sum.size(); ++i) ASSERT_NEAR(sum[i], analysis.samples[i], 1e-5) << i;
}

TEST(SoundAnalysis, SpectralSubtractionLeavesTheBone) {
  test::ScriptedDrilling script;
  const SoundAnalysis analysis = analyse(scripted_recording(script), {});
  ASSERT_TRUE(analysis.difference);
  const Difference& difference = *analysis.difference;
  const StateSpectrum* cortical = spectrum_of(analysis, DrillingState::cortical);
  ASSERT_NE(cortical, nullptr);
  // The cortical sound is 9 dB or more above the free one, so at most an eighth of its power goes with it.
  const double all_db = sound::band_db(cortical->spectrum, 0, 11025);
  EXPECT_NEAR(sound::band_db(difference.spectrum, 0, 11025), all_db, 1.5);
  const auto at = [&](double s) { return static_cast<std::size_t>(s * analysis.rate_hz); };
  const auto free = std::span(difference.samples).subspan(at(difference.free.from_s + 0.2), at(0.3));
  const auto heard = std::span(analysis.samples).subspan(at(difference.free.from_s + 0.2), at(0.3));
  EXPECT_LT(sound::rms_db(free), sound::rms_db(heard) - 6);
}

TEST(SoundAnalysis, RealRecordings) {
  const auto shared = test::find_shared();
  if (!shared) GTEST_SKIP() << "SKIPPED: no recordings: the folder shared/ is not beside the checkout";
  const auto drill = sound::read_wav(*shared / "data/sound/chai3d_drill.wav", sound::Channel::left);
  ASSERT_TRUE(drill) << drill.error().message;
  AnalysisParams params;
  params.spindle_rpm = 1425;
  const SoundAnalysis steady = analyse(*drill, params);
  // A geared drill at constant speed.
  EXPECT_EQ(steady.states.size(), 1U) << states_in_words(steady);
  EXPECT_EQ(steady.states.front().state, DrillingState::free);
  const auto twice_mesh = std::ranges::find(steady.lines, std::string_view("output mesh x2"),
                                            [](const FoundLine& of) { return of.line.name; });
  // Its loudest line, near 2280 Hz.
  ASSERT_TRUE(twice_mesh->peak);
  EXPECT_NEAR(twice_mesh->peak->hz, 2280, 5);

  const auto saw = sound::read_wav(*shared / "data/sound/opensfx_40_circular_saw.wav");
  ASSERT_TRUE(saw) << saw.error().message;
  const SoundAnalysis cut = analyse(*saw, {});
  SCOPED_TRACE(states_in_words(cut));
  // It runs up, cuts from 0.5 to 3.3 s, and runs down. It is another tool, so the kind of bone says nothing.
  const auto cutting =
      std::ranges::max_element(cut.states, {}, [](const sound::StateSpan& span) { return span.to_s - span.from_s; });
  EXPECT_TRUE(cutting->state == DrillingState::cortical || cutting->state == DrillingState::cancellous);
  EXPECT_NEAR(cutting->from_s, 0.5, 0.05);
  EXPECT_NEAR(cutting->to_s, 3.3, 0.15);
}

TEST(SoundAnalysis, LongRecordingsAreAnalysedInBoundedTime) {
  sound::WavSound recording;
  recording.rate_hz = 44100;
  std::uint32_t random = 1;
  for (int i = 0; i < 30 * 44100; ++i) {
    random = random * 1664525U + 1013904223U;
    recording.samples.push_back(1e-10F * static_cast<float>(random >> 1U) - 0.1F);
  }
  const std::clock_t begin = std::clock();
  const SoundAnalysis analysis = analyse(recording, {});
  const double work_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  std::printf("analysed 30 s in %.2f s of a processor: %.0f times as fast as it sounds\n", work_s, 30 / work_s);
  // Twenty times is the goal, which deploy/figures measures. A sanitizer takes most of it.
  EXPECT_GT(30 / work_s, 2);
  EXPECT_LE(analysis.spectrogram.columns, 2000U);
}

// The width and height of a PNG file, and how many colours it has.
struct PngFacts {
  int width = 0, height = 0;
  std::set<std::uint32_t> colours;
};

PngFacts png_facts(const fs::path& file) {
  PngFacts facts;
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) return facts;
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr) == 0) return facts;
  facts.width = static_cast<int>(image.width), facts.height = static_cast<int>(image.height);
  for (std::size_t i = 0; i + 2 < pixels.size(); i += 3)
    facts.colours.insert(static_cast<std::uint32_t>(pixels[i]) << 16U |
                         static_cast<std::uint32_t>(pixels[i + 1]) << 8U | pixels[i + 2]);
  return facts;
}

class AnalyseProgram : public testing::Test {
 protected:
  void SetUp() override {
    test::ScriptedDrilling script;
    const sound::WavSound recording = scripted_recording(script);
    ASSERT_TRUE(sound::write_wav(wav(), recording.samples, recording.rate_hz));
    seconds_ = recording.seconds();
  }
  [[nodiscard]] fs::path wav() const { return temp_ / "drilling.wav"; }
  [[nodiscard]] test::RunResult analyse_with(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "analyse");
    return test::run(test::program("osteon-audio"), arguments);
  }

  test::TempDir temp_;
  double seconds_ = 0;
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST_F(AnalyseProgram, WritesAFolderOfTablesAndPictures) {
  std::ofstream(temp_ / "depth.csv") << "time_s,phase,depth_mm\n1,free,0\n4,bone,3\n10,bone,21.5\n";
  const test::RunResult made = analyse_with({wav().string(), "--out", (temp_ / "out").string(), "--displacement",
                                             (temp_ / "depth.csv").string(), "--full-scale-pa", "20"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(test::names_in(temp_ / "out"),
            (std::set<std::string>{"analysis.json", "bands.csv", "bands.png", "difference.png", "difference.wav",
                                   "gears.csv", "packets.csv", "packets.png", "psd.csv", "psd.png", "spectrogram.csv",
                                   "spectrogram.png", "states.csv", "waveform.png"}));
  for (const char* picture : {"bands", "difference", "packets", "psd", "spectrogram", "waveform"}) {
    const PngFacts facts = png_facts(temp_ / "out" / (std::string(picture) + ".png"));
    EXPECT_EQ(facts.width, 1100) << picture;
    EXPECT_GE(facts.height, 300) << picture;
    EXPECT_GE(facts.colours.size(), 4U) << picture;
  }

  const auto report = nlohmann::json::parse(test::content(temp_ / "out/analysis.json"));
  EXPECT_EQ(report["recording"]["sample_rate_hz"], 48000);
  EXPECT_NEAR(report["recording"]["seconds"], seconds_, 0.001);
  ASSERT_EQ(report["wavelet_packets"].size(), 62U);
  for (const auto& packet : report["wavelet_packets"])
    if (packet["name"] == "ADAA4") {
      EXPECT_NEAR(packet["from_hz"], 2067, 1);
      EXPECT_NEAR(packet["to_hz"], 2756, 1);
    }
  // 20 Pa re 20 uPa is 120 dB.
  const auto& level = report["recording"]["level"];
  EXPECT_NEAR(level["db_spl"].get<double>() - level["db_full_scale"].get<double>(), 120.0, 0.002);
  // Each level's shares sum to 1.
  double sum = 0;
  for (const auto& packet : report["wavelet_packets"])
    if (packet["level"] == 5) sum += packet["energy_share"].get<double>();
  EXPECT_NEAR(sum, 1.0, 1e-4);

  const std::vector<std::string> bands = lines_of(test::content(temp_ / "out/bands.csv"));
  EXPECT_EQ(bands.front().substr(0, 41), "time_s,displacement_mm,whole_db,AAAA4_db,");
  EXPECT_EQ(std::ranges::count(bands.front(), ','), 14);
  // Half-way between 1 and 4 s the drill is at 1.5 mm.
  const auto row = std::ranges::find_if(bands, [](const std::string& line) { return line.starts_with("2.50"); });
  ASSERT_NE(row, bands.end());
  EXPECT_NEAR(std::stod(row->substr(row->find(',') + 1)), 1.5, 0.02);

  const auto difference = sound::read_wav(temp_ / "out/difference.wav");
  ASSERT_TRUE(difference) << difference.error().message;
  EXPECT_EQ(difference->rate_hz, 22050);
  EXPECT_NEAR(difference->seconds(), seconds_, 0.001);

  // A second time, the folder is there.
  const test::RunResult again = analyse_with({wav().string(), "--out", (temp_ / "out").string()});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.err, testing::HasSubstr("already there"));
}

TEST_F(AnalyseProgram, TheSameRecordingHasTheSameFiles) {
  for (const char* folder : {"one", "two"})
    ASSERT_EQ(analyse_with({wav().string(), "--out", (temp_ / folder).string()}).exit_code, 0);
  for (const std::string& file : test::names_in(temp_ / "one"))
    EXPECT_EQ(test::content(temp_ / "one" / file), test::content(temp_ / "two" / file)) << file;
}

TEST_F(AnalyseProgram, WithoutAFolderItOnlySays) {
  const test::RunResult said = analyse_with({wav().string(), "--rpm", "1200"});
  ASSERT_EQ(said.exit_code, 0) << said.err;
  EXPECT_THAT(said.out, testing::AllOf(testing::HasSubstr("cortical"), testing::HasSubstr("motor mesh"),
                                       testing::HasSubstr("times as fast")));
  EXPECT_EQ(said.err, "");
}

TEST_F(AnalyseProgram, WrongUseIsOneSentenceEach) {
  const auto put = [&](const char* name, std::string_view text) {
    std::ofstream(temp_ / name, std::ios::binary) << text;
    return (temp_ / name).string();
  };
  const std::string whole = test::content(wav());
  const std::string drilling = wav().string();
  std::string stereo = whole, coarse = whole, fast = whole;
  stereo[22] = 2, stereo[32] = 4;               // NumChannels, BlockAlign
  coarse[34] = 8, coarse[32] = 1;               // BitsPerSample, BlockAlign
  fast[24] = 0, fast[25] = 0x77, fast[26] = 1;  // SampleRate 96000
  struct Wrong {
    std::vector<std::string> arguments;
    std::vector<std::string> says;
  };
  const std::vector<Wrong> cases = {
      {{"nothing.wav"}, {"nothing.wav", "give the path"}},
      {{}, {"FILE"}},
      {{put("text.wav", "no sound at all\n")}, {"text.wav", "no WAV file", "convert"}},
      {{put("empty.wav", "")}, {"empty.wav", "empty"}},
      {{put("cut.wav", whole.substr(0, whole.size() / 2))}, {"cut.wav", "truncated", "again"}},
      {{put("stereo.wav", stereo)}, {"stereo.wav", "NumChannels is 2", "--channel"}},
      {{put("coarse.wav", coarse)}, {"coarse.wav", "BitsPerSample is 8", "16 bits"}},
      {{put("fast.wav", fast)}, {"fast.wav", "SampleRate is 96000", "44100"}},
      {{temp_.path().string()}, {"folder"}},
      {{drilling, "--out", "/proc/nowhere/out"}, {"/proc/nowhere/out", "may write"}},
      {{drilling, "--out", drilling}, {"drilling.wav", "already there"}},
      {{drilling, "--channel", "middle"}, {"--channel", "middle"}},
      {{drilling, "--rpm", "0"}, {"--rpm"}},
      {{drilling, "--free", "3", "2"}, {"--free", "drilling.wav"}},
      {{drilling, "--free", "3"}, {"--free"}},
      {{drilling, "--full-scale-pa", "-1"}, {"--full-scale-pa"}},
      {{drilling, "--displacement", "no.csv"}, {"no.csv", "time_s"}},
      {{drilling, "--displacement", put("a.csv", "time,depth_mm\n1,2\n")}, {"a.csv", "line 1", "time_s"}},
      {{drilling, "--displacement", put("b.csv", "time_s,x\n1,2\n")}, {"b.csv", "line 1", "displacement_mm"}},
      {{drilling, "--displacement", put("c.csv", "time_s,depth_mm\n1,2\n2,far\n")}, {"c.csv", "line 3", "depth_mm"}},
      {{drilling, "--displacement", put("d.csv", "time_s,depth_mm\n1,2\n0,3\n")}, {"d.csv", "line 3", "sort"}},
      {{drilling, "--displacement", put("e.csv", "time_s,depth_mm\n1\n")}, {"e.csv", "line 2", "depth_mm"}},
      {{drilling, "--displacement", put("f.csv", "time_s,depth_mm\n")}, {"f.csv", "no row"}},
      {{drilling, "--displacement", put("g.csv", "")}, {"g.csv", "time_s"}},
  };
  for (const Wrong& wrong : cases) {
    const test::RunResult result = analyse_with(wrong.arguments);
    EXPECT_EQ(result.exit_code, 1) << wrong.says.front();
    EXPECT_THAT(result.err, testing::StartsWith("osteon-audio: "));
    for (const std::string& words : wrong.says) EXPECT_THAT(result.err, testing::HasSubstr(words));
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }
  EXPECT_FALSE(fs::exists(temp_ / "out"));
}

}  // namespace
}  // namespace osteon::audio
