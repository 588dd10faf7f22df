// osteon-audio analyse: states of a drilling that our own synthesis made and of real recordings, the files that it
// writes, and what it says to wrong use.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "audio_client/analysis/analysis.hpp"
#include "audio_client/analysis/analysis_plots.hpp"
#include "audio_client/analysis/analysis_report.hpp"
#include "audio_client/analysis/plot.hpp"
#include "audio_client/synth/drill_synth.hpp"
#include "common/sound/levels.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"
#include "tests/unit/sound/signals.hpp"

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

// The synthesis was made from 8.5.4, and the rules are those of 8.5.4. So this shows that both agree, and not that real
// bone is recognised.
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

void expect_a_steady_drill(const SoundAnalysis& steady) {
  // A geared drill at constant speed.
  EXPECT_EQ(steady.states.size(), 1U) << states_in_words(steady);
  EXPECT_EQ(steady.states.front().state, DrillingState::free);
  const auto twice_mesh = std::ranges::find(steady.lines, std::string_view("output mesh x2"),
                                            [](const FoundLine& of) { return of.line.name; });
  // Its loudest line, near 2280 Hz.
  ASSERT_TRUE(twice_mesh->peak);
  EXPECT_NEAR(twice_mesh->peak->hz, 2280, 5);
  // What its description says is heard. The line near 3420 Hz is broad, and highest at 3386 Hz.
  for (const auto& [hz, within_hz] : {std::pair{2280.0, 15.0}, std::pair{3420.0, 40.0}, std::pair{6840.0, 15.0}})
    EXPECT_TRUE(std::ranges::any_of(steady.spectra.front().peaks, [hz = hz,
                                                                   within_hz = within_hz](const sound::Peak& peak) {
      return std::abs(peak.hz - hz) < within_hz;
    })) << hz;
}

// It runs up, cuts from 0.5 to 3.3 s, and runs down. It is another tool, so the kind of bone says nothing.
void expect_a_cutting_saw(const SoundAnalysis& cut) {
  SCOPED_TRACE(states_in_words(cut));
  const auto cutting =
      std::ranges::max_element(cut.states, {}, [](const sound::StateSpan& span) { return span.to_s - span.from_s; });
  EXPECT_TRUE(cutting->state == DrillingState::cortical || cutting->state == DrillingState::cancellous);
  EXPECT_NEAR(cutting->from_s, 0.5, 0.05);
  EXPECT_NEAR(cutting->to_s, 3.3, 0.15);
}

struct HeardRecording {
  const char* file;
  double rpm;
  void (*expect)(const SoundAnalysis&);
};

// Our own imitation of the drill, and the recordings beside the checkout.
std::vector<HeardRecording> recordings() {
  std::vector<HeardRecording> all{{"own_drill.wav", 1425, expect_a_steady_drill}};
  if (test::find_shared())
    all.insert(all.end(), {{"chai3d_drill.wav", 1425, expect_a_steady_drill},
                           {"opensfx_40_circular_saw.wav", 1400, expect_a_cutting_saw}});
  else
    std::cerr << "SKIPPED: recordings of tools: the folder shared/ is not beside the checkout\n";
  return all;
}

class SoundOfTools : public testing::TestWithParam<HeardRecording> {};

TEST_P(SoundOfTools, IsAnalysedAsHeard) {
  const test::TempDir temp;
  constexpr std::size_t kCount = 3 * 22050;
  std::vector<float> drill = sound::white_noise(0.01, kCount, 5);
  for (const auto& [hz, amplitude] : {std::pair{2280.0, 0.2}, std::pair{3420.0, 0.1}, std::pair{6840.0, 0.1}})
    drill = sound::added(std::move(drill), sound::tone(hz, amplitude, kCount, 22050));
  ASSERT_TRUE(sound::write_wav(temp / "own_drill.wav", drill, 22050));
  const fs::path own = temp / GetParam().file;
  const auto recording = sound::read_wav(fs::exists(own) ? own : *test::find_shared() / "data/sound" / GetParam().file,
                                         {.channel = sound::Channel::left});
  ASSERT_TRUE(recording) << recording.error().message;
  AnalysisParams params;
  params.spindle_rpm = GetParam().rpm;
  GetParam().expect(analyse(*recording, params));
}
INSTANTIATE_TEST_SUITE_P(OwnAndReal, SoundOfTools, testing::ValuesIn(recordings()));

std::vector<float> noise_with(double noise, const std::vector<std::pair<double, double>>& tones, double seconds) {
  const auto count = static_cast<std::size_t>(seconds * kAnalysisRate_hz);
  std::vector<float> samples = sound::white_noise(noise, count, 7);
  for (const auto& [hz, amplitude] : tones)
    samples = sound::added(std::move(samples), sound::tone(hz, amplitude, count, kAnalysisRate_hz));
  return samples;
}

std::optional<sound::Peak> peak_of(const SoundAnalysis& analysis, std::string_view line) {
  return std::ranges::find(analysis.lines, line, [](const FoundLine& of) { return of.line.name; })->peak;
}

TEST(SoundAnalysis, LinesAreFoundInNoiseBesideTheirSidebands) {
  // The output mesh at 1120 Hz with the sidebands of its planets (8.5.2), the motor's mesh, and no other line.
  const double side = 0.05 * std::pow(10.0, -1.0 / 20);
  const sound::WavSound recording{
      .rate_hz = kAnalysisRate_hz,
      .samples =
          noise_with(0.01, {{1119.84, 0.05}, {1119.84 - 74.66, side}, {1119.84 + 74.66, side}, {4014.7, 0.02}}, 4.0)};
  const SoundAnalysis analysis = analyse(recording, {});
  for (const auto& [line, hz, amplitude] :
       {std::tuple{"output mesh", 1119.84, 0.05}, std::tuple{"motor mesh", 4014.7, 0.02}}) {
    const auto peak = peak_of(analysis, line);
    ASSERT_TRUE(peak) << line;
    EXPECT_NEAR(peak->hz, hz, 1) << line;
    EXPECT_NEAR(peak->level_db, 20 * std::log10(amplitude) - 3.01, 0.5) << line;
  }
  for (const char* line : {"motor spin", "output mesh x2", "output mesh x3", "commutation", "commutation x3"})
    EXPECT_FALSE(peak_of(analysis, line)) << line;
}

TEST(SoundAnalysis, AWeakLineIsNoLine) {
  // 3 dB above five bins of the noise around it: 0.01^2 * 5 / 2048, and a half of the amplitude's square.
  const double amplitude = std::sqrt(2 * 1e-4 * 5 / 2048);
  const SoundAnalysis analysis =
      analyse({.rate_hz = kAnalysisRate_hz, .samples = noise_with(0.01, {{4014.7, amplitude}}, 4.0)}, {});
  EXPECT_FALSE(peak_of(analysis, "motor mesh"));
}

TEST(SoundAnalysis, AHighRateIsConvertedFirst) {
  const auto count = static_cast<std::size_t>(2 * 192000);
  sound::WavSound recording{.rate_hz = 192000, .samples = sound::tone(1119.84, 0.1, count, 192000)};
  recording.samples = sound::added(std::move(recording.samples), sound::tone(40000, 0.5, count, 192000));
  const SoundAnalysis analysis = analyse(recording, {});
  EXPECT_EQ(analysis.samples.size(), 2U * kAnalysisRate_hz);
  EXPECT_NEAR(analysis.level_db, -23.01, 0.05);
  ASSERT_TRUE(peak_of(analysis, "output mesh"));
  EXPECT_NEAR(peak_of(analysis, "output mesh")->hz, 1119.84, 1);
}

TEST(SoundAnalysis, OnlyFramesWithinTheFreeSpanAreSubtracted) {
  // The free sound ends 0.52 hops after a frame's middle, before one that is 50 dB louder.
  constexpr double kHop_s = 512.0 / kAnalysisRate_hz, kEnd_s = 43.52 * kHop_s;
  sound::WavSound recording{.rate_hz = kAnalysisRate_hz, .samples = noise_with(0.001, {}, kEnd_s)};
  const std::vector<float> loud = noise_with(0.3, {}, 1.5);
  recording.samples.insert(recording.samples.end(), loud.begin(), loud.end());
  AnalysisParams params;
  params.free = sound::TimeSpan{kEnd_s - 10 * kHop_s, kEnd_s};
  const SoundAnalysis analysis = analyse(recording, params);
  ASSERT_TRUE(analysis.difference);
  // Noise less itself keeps -4.3 dB in the transform, and up to 3 dB less in time. With the loud sound in the mean,
  // nothing of it would be left.
  const auto part = [](const std::vector<float>& samples) { return std::span(samples).subspan(4410, 8820); };
  EXPECT_GT(sound::rms_db(part(analysis.difference->samples)), sound::rms_db(part(analysis.samples)) - 9);
}

TEST(SoundAnalysis, SilenceIsDarkAndSaysThatNoDrillWasHeard) {
  const SoundAnalysis silence =
      analyse({.rate_hz = kAnalysisRate_hz, .channels = 2, .samples = std::vector<float>(22050, 0.0F)}, {});
  const std::string text = to_text(silence);
  EXPECT_THAT(text, testing::HasSubstr("no drill was heard; is it the right --channel?"));
  EXPECT_EQ(silence.states.front().level_db, silence.level_db);
  EXPECT_FALSE(silence.difference);
  const std::vector<NamedPicture> pictures = pictures_of(silence, {});
  const auto spectrogram = std::ranges::find(pictures, "spectrogram.png", &NamedPicture::file);
  ASSERT_NE(spectrogram, pictures.end());
  EXPECT_EQ(spectrogram->picture.at(600, 200), heat(0.0));
  const SoundAnalysis drill = analyse({.rate_hz = kAnalysisRate_hz, .samples = noise_with(0.1, {}, 1.0)}, {});
  EXPECT_THAT(to_text(drill), testing::Not(testing::HasSubstr("note")));
}

TEST(SoundAnalysis, NamesOfShortStatesDoNotLieOnEachOther) {
  SoundAnalysis analysis = analyse({.rate_hz = kAnalysisRate_hz, .samples = std::vector<float>(22050, 0.0F)}, {});
  using enum sound::DrillingState;
  // "perforation" is wider than its span, and "free" begins within it.
  analysis.states = {{cortical, 0, 0.5}, {perforation, 0.5, 0.53}, {free, 0.53, 1.0}};
  const std::vector<NamedPicture> pictures = pictures_of(analysis, {});
  const auto spectrogram = std::ranges::find(pictures, "spectrogram.png", &NamedPicture::file);
  ASSERT_NE(spectrogram, pictures.end());
  // The frame begins at (64, 24) and is 1020 wide. A name begins 3 pixels behind its span's line, and lines of names
  // are 10 pixels apart.
  const auto white = [&](double from_s, double to_s, int line) {
    int count = 0;
    for (int x = 64 + static_cast<int>(1020 * from_s) + 3; x < 64 + static_cast<int>(1020 * to_s) - 3; ++x)
      for (int y = 24 + 3 + 10 * line; y < 24 + 10 + 10 * line; ++y) count += spectrogram->picture.at(x, y) == kPaper;
    return count;
  };
  EXPECT_GT(white(0.0, 0.2, 0), 20) << "cortical";
  EXPECT_EQ(white(0.0, 0.2, 1), 0);
  EXPECT_GT(white(0.5, 0.53, 0), 20) << "perforation";
  EXPECT_GT(white(0.53, 0.6, 1), 20) << "free";
  EXPECT_EQ(white(0.6, 1.0, 0), 0);
}

TEST(SoundAnalysis, NamesOfLinesBeyondTheAxisAreNotWritten) {
  // At 6000 rpm the motor's mesh and commutation x2 and x3 are beyond 11025 Hz.
  AnalysisParams fast, slow;
  fast.spindle_rpm = 6000, slow.spindle_rpm = 1400;
  const auto ink_at_the_right = [](const AnalysisParams& params) {
    const SoundAnalysis analysis = analyse({.rate_hz = kAnalysisRate_hz, .samples = noise_with(0.1, {}, 1.0)}, params);
    const std::vector<NamedPicture> pictures = pictures_of(analysis, {});
    const auto psd = std::ranges::find(pictures, "psd.png", &NamedPicture::file);
    int pixels = 0;
    for (int y = 24; y < 370; ++y)
      for (int x = 1045; x < 1084; ++x) pixels += psd->picture.at(x, y) == picture::Colour{120, 90, 40};
    return pixels;
  };
  EXPECT_EQ(ink_at_the_right(slow), 0);
  EXPECT_EQ(ink_at_the_right(fast), 0);
}

// In psd.png they all may lie on each other. Only one is a grey, and another black.
TEST(SoundAnalysis, NoTwoCurvesHaveNearlyOneColour) {
  std::vector<picture::Colour> colours{kWholeColour};
  for (std::size_t i = 0; i < sound::kDrillingStates; ++i)
    colours.push_back(colour_of(static_cast<sound::DrillingState>(i)));
  const auto grey = [](picture::Colour c) { return c.red == c.green && c.green == c.blue; };
  for (std::size_t i = 0; i < colours.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const picture::Colour a = colours[i], b = colours[j];
      const double apart = std::hypot(a.red - b.red, a.green - b.green, a.blue - b.blue);
      EXPECT_GT(apart, grey(a) && grey(b) ? 150 : 60) << i << " and " << j;
    }
}

// At the first file, in the middle, and when all files are there.
TEST(WriteAnalysis, AStopLeavesNothing) {
  const SoundAnalysis analysis = analyse({.rate_hz = kAnalysisRate_hz, .samples = noise_with(0.1, {}, 1.0)}, {});
  const test::TempDir temp;
  std::vector<double> done;
  const auto count = [&](double fraction) { return done.push_back(fraction), true; };
  ASSERT_TRUE(write_analysis(analysis, {}, temp / "whole", count));
  EXPECT_EQ(done.size(), test::names_in(temp / "whole").size()) << "asked once for each file";
  EXPECT_TRUE(std::ranges::is_sorted(done));
  EXPECT_NEAR(done.back(), 1.0, 1e-12);
  for (const std::size_t stop_at : {std::size_t{1}, done.size() / 2, done.size()}) {
    std::size_t asked = 0;
    const auto written = write_analysis(analysis, {}, temp / "stopped", [&](double) { return ++asked < stop_at; });
    ASSERT_FALSE(written) << stop_at;
    EXPECT_EQ(written.error().code, ErrorCode::cancelled);
    EXPECT_EQ(asked, stop_at) << "it goes on after the stop";
    EXPECT_EQ(test::names_in(temp.path()), std::set<std::string>{"whole"}) << stop_at;
  }
}

// A PNG file, row by row.
struct Png {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;

  [[nodiscard]] picture::Colour at(int x, int y) const {
    const auto i = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
    return {pixels[i], pixels[i + 1], pixels[i + 2]};
  }
  [[nodiscard]] int count(const picture::Colour& colour) const {
    int found = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) found += at(x, y) == colour;
    return found;
  }
};

Png png_of(const fs::path& file) {
  Png png;
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) return png;
  image.format = PNG_FORMAT_RGB;
  png.pixels.resize(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, png.pixels.data(), 0, nullptr) == 0) return png;
  png.width = static_cast<int>(image.width), png.height = static_cast<int>(image.height);
  return png;
}

// How bright a colour of heat() is.
int brightness(const picture::Colour& colour) { return colour.red + colour.green + colour.blue; }

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
  // "out", with a displacement.
  void make_folder() const {
    std::ofstream(temp_ / "depth.csv") << "time_s,phase,depth_mm\n1,free,0\n4,bone,3\n10,bone,21.5\n";
    const test::RunResult made = analyse_with({wav().string(), "--out", (temp_ / "out").string(), "--displacement",
                                               (temp_ / "depth.csv").string(), "--full-scale-pa", "20"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
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

TEST_F(AnalyseProgram, AResultThatCannotBePrintedIsAFailure) {
  const test::RunResult full = test::run("/bin/sh", {"-c", "exec \"$0\" analyse \"$1\" > /dev/full",
                                                     test::program("osteon-audio").string(), wav().string()});
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_THAT(full.err, testing::HasSubstr("standard output: No space left on device; send it"));
}

TEST_F(AnalyseProgram, WritesAFolderOfTablesAndPictures) {
  ASSERT_NO_FATAL_FAILURE(make_folder());
  EXPECT_EQ(test::names_in(temp_ / "out"),
            (std::set<std::string>{"analysis.json", "bands.csv", "bands.png", "difference.png", "difference.wav",
                                   "gears.csv", "packets.csv", "packets.png", "psd.csv", "psd.png", "spectrogram.csv",
                                   "spectrogram.png", "states.csv", "waveform.png"}));
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
  EXPECT_EQ(report["recording"]["format"], "integer");
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

// Whether the signal comes before the last file or after it.
TEST_F(AnalyseProgram, ASignalLeavesTheWholeFolderOrNone) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const fs::path out = temp_ / ("out-" + std::to_string(signal));
    test::Process audio(test::program("osteon-audio"), {"analyse", wav().string(), "--out", out.string()});
    const fs::path partial = out.string() + ".partial-" + std::to_string(audio.pid());
    ASSERT_TRUE(test::wait_until([&] { return fs::exists(partial) || fs::exists(out); }, std::chrono::seconds(60)))
        << audio.err();
    audio.signal(signal);
    const std::optional<int> code = audio.wait(std::chrono::seconds(60));
    EXPECT_FALSE(fs::exists(partial)) << signal;
    if (fs::exists(out)) {
      EXPECT_EQ(test::names_in(out).size(), 14U) << signal;
      continue;
    }
    EXPECT_EQ(code, 130) << signal;
    EXPECT_THAT(audio.err(), testing::EndsWith("osteon-audio: stopped; " + out.string() + " was not written\n"));
  }
}

TEST_F(AnalyseProgram, ThePicturesShowTheirCurves) {
  ASSERT_NO_FATAL_FAILURE(make_folder());
  for (const char* picture : {"bands", "difference", "packets", "psd", "spectrogram", "waveform"}) {
    const Png png = png_of(temp_ / "out" / (std::string(picture) + ".png"));
    EXPECT_EQ(png.width, 1100) << picture;
    EXPECT_GE(png.height, 300) << picture;
  }
  // Each curve is there: the signal over time, in twelve bands, and the densities of two states.
  constexpr picture::Colour kSignal{74, 111, 165}, kFree{0, 114, 178}, kCortical{213, 94, 0}, kDepth{200, 85, 61};
  EXPECT_GT(png_of(temp_ / "out/waveform.png").count(kSignal), 5000);
  EXPECT_GT(png_of(temp_ / "out/bands.png").count(kSignal), 12 * 2000);
  EXPECT_GT(png_of(temp_ / "out/bands.png").count(kDepth), 13 * 500);
  // Each band has the displacement's axis at its right, and the first panel, the displacement itself, has none.
  const Png bands = png_of(temp_ / "out/bands.png");
  for (int panel = 0; panel < 13; ++panel) {
    int axis = 0;
    for (int y = 24 + 134 * panel; y < 24 + 134 * panel + 84; ++y) axis += bands.at(1100 - 44, y) == kDepth;
    EXPECT_EQ(axis, panel == 0 ? 0 : 84) << panel;
  }
  EXPECT_GT(png_of(temp_ / "out/packets.png").count(kSignal), 2000);
  EXPECT_GT(png_of(temp_ / "out/psd.png").count(kFree), 1000);
  EXPECT_GT(png_of(temp_ / "out/psd.png").count(kCortical), 1000);
  EXPECT_GT(png_of(temp_ / "out/difference.png").count(kSignal), 2000);
  EXPECT_GT(png_of(temp_ / "out/difference.png").count(kCortical), 1000);

  // Where the spectrogram shows the motor's third harmonic, it is bright while the drill runs, and dark before.
  const Png spectrogram = png_of(temp_ / "out/spectrogram.png");
  const auto at_motor = [&](double time_s) {
    int brightest = 0;
    for (int y = -6; y <= 6; ++y)
      brightest =
          std::max(brightest, brightness(spectrogram.at(64 + static_cast<int>(1020 * time_s / seconds_),
                                                        24 + static_cast<int>(346 * (1 - 5353.0 / 11025)) + y)));
    return brightest;
  };
  const auto report = nlohmann::json::parse(test::content(temp_ / "out/analysis.json"));
  const auto& states = report["states"];
  const auto middle_of = [&](std::string_view state) {
    for (const auto& span : states)
      if (span["state"] == state) return 0.5 * (span["from_s"].get<double>() + span["to_s"].get<double>());
    return -1.0;
  };
  EXPECT_GT(at_motor(middle_of("cortical")), at_motor(middle_of("before")) + 150);
}

TEST_F(AnalyseProgram, TheTableOfGearsHasThePeaks) {
  ASSERT_NO_FATAL_FAILURE(make_folder());
  const auto report = nlohmann::json::parse(test::content(temp_ / "out/analysis.json"));
  const std::vector<std::string> gears = lines_of(test::content(temp_ / "out/gears.csv"));
  ASSERT_EQ(gears.size(), report["gear_lines"].size() + 1);
  int found = 0;
  for (std::size_t i = 0; i + 1 < gears.size(); ++i) {
    const auto& line = report["gear_lines"][i];
    std::istringstream row(gears[i + 1]);
    std::vector<std::string> fields;
    for (std::string field; std::getline(row, field, ',');) fields.push_back(field);
    ASSERT_EQ(fields.size() == 5, line.contains("found")) << gears[i + 1];
    if (fields.size() < 5) continue;
    ++found;
    EXPECT_NEAR(std::stod(fields[3]), line["found"]["hz"].get<double>(), 0.002);
    EXPECT_NEAR(std::stod(fields[3]), line["hz"].get<double>(), std::max(11.0, 0.031 * line["hz"].get<double>()));
  }
  EXPECT_GE(found, 3);
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
  // On a busy computer, this short work may last long enough to show its progress.
  for (const std::string& line : lines_of(said.err)) EXPECT_THAT(line, testing::StartsWith("analysing: "));
}

TEST_F(AnalyseProgram, APartHasItsOwnTimes) {
  // A table whose first bytes are the mark that a spreadsheet writes.
  std::ofstream(temp_ / "depth.csv") << "\xEF\xBB\xBFtime_s,displacement_mm\n100,0\n120,20\n";
  const test::RunResult made =
      analyse_with({wav().string(), "--from", "2", "--to", "8.5", "--out", (temp_ / "out").string(), "--displacement",
                    (temp_ / "depth.csv").string(), "--displacement-start", "101"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, testing::HasSubstr("part       from 2.000 s of"));
  const auto report = nlohmann::json::parse(test::content(temp_ / "out/analysis.json"));
  EXPECT_EQ(report["recording"]["from_s"], 2.0);
  EXPECT_NEAR(report["recording"]["file_s"], seconds_, 0.001);
  EXPECT_EQ(report["recording"]["seconds"], 6.5);
  EXPECT_EQ(report["states"].back()["to_s"], 6.5);
  // The part begins in the table's second 101, at 1 mm.
  const std::vector<std::string> bands = lines_of(test::content(temp_ / "out/bands.csv"));
  const double mm = std::stod(bands[1].substr(bands[1].find(',') + 1));
  EXPECT_NEAR(mm, 1.0, 0.02);
}

TEST_F(AnalyseProgram, WhatIsThereOfACutRecordingIsAnalysed) {
  const std::string whole = test::content(wav());
  const auto said = [&](const std::string& changed) {
    std::ofstream(temp_ / "changed.wav", std::ios::binary) << changed;
    const test::RunResult result = analyse_with({(temp_ / "changed.wav").string()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  EXPECT_THAT(said(whole.substr(0, 44 + 2 * 48000 * 5)),
              testing::ContainsRegex("the header announces .* s; 5 s are there"));
  std::string streamed = whole, coarse = whole;
  streamed.replace(40, 4, std::string(4, '\xFF'));
  EXPECT_THAT(said(streamed), testing::HasSubstr("the header gives no length"));
  coarse[34] = 8, coarse[32] = 1;  // BitsPerSample, BlockAlign
  EXPECT_THAT(said(coarse), testing::HasSubstr("8 bits: their quantisation noise"));
  EXPECT_THAT(said(whole), testing::Not(testing::HasSubstr("note")));
}

TEST(Analysis, GoesOnInPartsUntilItIsStopped) {
  const sound::WavSound recording{.rate_hz = kAnalysisRate_hz, .samples = noise_with(0.1, {}, 1.0)};
  std::vector<double> done;
  const auto whole = analyse(recording, {}, [&](double fraction) {
    done.push_back(fraction);
    return true;
  });
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_TRUE(std::ranges::is_sorted(done));
  EXPECT_GE(done.size(), 5U);
  EXPECT_DOUBLE_EQ(done.back(), 1.0);
  int calls = 0;
  const auto stopped = analyse(recording, {}, [&](double) { return ++calls < 3; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  EXPECT_EQ(calls, 3) << "it ends there";
}

// The longest recording, with tables and pictures: they take seconds.
TEST_F(AnalyseProgram, AStopIsOneSentenceAndWritesNothing) {
  const fs::path file = temp_ / "long.wav";
  ASSERT_TRUE(sound::write_wav(file, sound::white_noise(0.1, 96000 * 299, 1), 96000));
  test::Process audio(test::program("osteon-audio"), {"analyse", file.string(), "--out", (temp_ / "out").string()});
  ASSERT_TRUE(
      test::wait_until([&] { return audio.err().find("analysing: ") != std::string::npos; }, std::chrono::seconds(60)))
      << audio.err();
  audio.signal(SIGINT);
  EXPECT_EQ(audio.wait(std::chrono::seconds(60)), 130);
  EXPECT_THAT(audio.err(),
              testing::HasSubstr("osteon-audio: stopped; " + (temp_ / "out").string() + " was not written"));
  EXPECT_EQ(audio.out(), "");
  EXPECT_FALSE(fs::exists(temp_ / "out"));
}

// Wrong use of the program, and what its one sentence says.
class AnalyseWrongUse : public AnalyseProgram {
 protected:
  struct Wrong {
    std::vector<std::string> arguments;
    std::vector<std::string> says;
  };
  [[nodiscard]] std::string put(const char* name, std::string_view text) const {
    std::ofstream(temp_ / name, std::ios::binary) << text;
    return (temp_ / name).string();
  }
  void expect_one_sentence_each(const std::vector<Wrong>& cases) const {
    for (const Wrong& wrong : cases) {
      const test::RunResult result = analyse_with(wrong.arguments);
      EXPECT_EQ(result.exit_code, 1) << wrong.says.front();
      EXPECT_THAT(result.err, testing::StartsWith("osteon-audio: "));
      for (const std::string& words : wrong.says) EXPECT_THAT(result.err, testing::HasSubstr(words));
      EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
      EXPECT_EQ(result.out, "");
    }
  }
};

TEST_F(AnalyseWrongUse, IsOneSentenceEach) {
  const std::string whole = test::content(wav());
  const std::string drilling = wav().string();
  std::string stereo = whole, slow = whole;
  stereo[22] = 2, stereo[32] = 4;                  // NumChannels, BlockAlign
  slow[24] = 0x40, slow[25] = 0x1F, slow[26] = 0;  // SampleRate 8000
  const std::string table = put("late.csv", "time_s,depth_mm\n100,2\n110,3\n");
  const std::vector<Wrong> cases = {
      {{"nothing.wav"}, {"nothing.wav", "give the path"}},
      {{}, {"FILE"}},
      {{put("text.wav", "no sound at all\n")}, {"text.wav", "no WAV file", "convert"}},
      {{put("empty.wav", "")}, {"empty.wav", "empty"}},
      {{put("cut.wav", whole.substr(0, 40))}, {"cut.wav", "truncated", "again"}},
      {{put("stereo.wav", stereo)}, {"stereo.wav", "NumChannels is 2", "--channel"}},
      {{put("slow.wav", slow)}, {"slow.wav", "SampleRate is 8000", "44100"}},
      {{temp_.path().string()}, {"folder"}},
      {{drilling, "--out", "/proc/nowhere/out"}, {"/proc/nowhere/out", "may write"}},
      {{drilling, "--out", (temp_ / "no/folder").string()}, {"no/folder", "--out", "a folder that exists"}},
      {{drilling, "--out", (temp_ / "no/folder/").string()}, {"no/folder/", "--out", "a folder that exists"}},
      {{drilling, "--out", ""}, {"--out: the name is empty", "osteon-audio analyse --help"}},
      {{drilling, "--out", drilling}, {"drilling.wav", "already there"}},
      {{drilling, "--channel", "middle"}, {"--channel", "middle"}},
      {{drilling, "--rpm", "0"}, {"--rpm"}},
      {{drilling, "--rpm", "nan"}, {"--rpm", "nan is not a number from 10 to 100000"}},
      {{drilling, "--full-scale-pa", "nan"}, {"--full-scale-pa", "nan is not a number from 1e-06 to 1000000"}},
      {{drilling, "--free", "nan", "2"}, {"--free", "drilling.wav"}},
      {{drilling, "--free", "0.1", "nan"}, {"--free", "drilling.wav"}},
      {{drilling, "--free", "3", "2"}, {"--free", "drilling.wav"}},
      {{drilling, "--free", "3"}, {"--free"}},
      {{drilling, "--full-scale-pa", "-1"}, {"--full-scale-pa"}},
      {{drilling, "--channel", "2"}, {"drilling.wav", "NumChannels is 1", "channel 2"}},
      {{drilling, "--from", "1000"}, {"drilling.wav", "--from"}},
      {{drilling, "--from", "3", "--to", "3.1"}, {"drilling.wav", "the part lasts 0.1 s"}},
      {{drilling, "--displacement", table}, {"--displacement", "--out"}},
      {{drilling, "--displacement-start", "1"}, {"--displacement-start", "--displacement"}},
  };
  expect_one_sentence_each(cases);
  EXPECT_FALSE(fs::exists(temp_ / "out"));
  EXPECT_FALSE(fs::exists(temp_ / "no"));
}

TEST_F(AnalyseWrongUse, OfATableIsOneSentenceEach) {
  const std::string drilling = wav().string();
  const std::string table = put("late.csv", "time_s,depth_mm\n100,2\n110,3\n");
  const std::vector<Wrong> cases = {
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", table},
       {"late.csv", "100 to 110 s", "--displacement-start"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", temp_.path().string()}, {"folder"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", "no.csv"}, {"no.csv", "time_s"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", put("a.csv", "time,depth_mm\n1,2\n")},
       {"a.csv", "line 1", "time_s"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", put("b.csv", "time_s,x\n1,2\n")},
       {"b.csv", "line 1", "displacement_mm"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", put("c.csv", "time_s,depth_mm\n1,2\n2,far\n")},
       {"c.csv", "line 3", "depth_mm"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", put("d.csv", "time_s,depth_mm\n1,2\n0,3\n")},
       {"d.csv", "line 3", "sort"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", put("e.csv", "time_s,depth_mm\n1\n")},
       {"e.csv", "line 2", "depth_mm"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", put("f.csv", "time_s,depth_mm\n")},
       {"f.csv", "no row"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", put("h.csv", "time_s,depth_mm\n0,0,1,5\n")},
       {"h.csv: line 2 has 4 fields, and line 1 has 2", "with a point"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", put("i.csv", "time_s;depth_mm\n0;1\n")},
       {"i.csv", "separated by a comma"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", put("j.csv", "time_s,depth_mm,time_s\n0,1,2\n")},
       {"j.csv: line 1 has the column time_s more than once"}},
      {{drilling, "--out", (temp_ / "out").string(), "--displacement", put("g.csv", "")}, {"g.csv", "time_s"}},
  };
  expect_one_sentence_each(cases);
  EXPECT_FALSE(fs::exists(temp_ / "out"));
}

}  // namespace
}  // namespace osteon::audio
