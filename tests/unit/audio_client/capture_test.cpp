// osteon-audio record, run by deploy/with-null-sink: a tone that is played into the sink is recorded from its monitor.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <numbers>
#include <thread>

#include "audio_client/output/audio_output.hpp"
#include "common/runtime/files.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/tones.hpp"
#include "common/sound/wav_file.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"

namespace osteon::audio {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

constexpr double kTone_hz = 1000;

struct SteadyTone final : SoundSource {
  std::atomic<std::uint64_t> frames{0};
  void render(std::span<float> left, std::span<float> right) noexcept override {
    const std::uint64_t at = frames.load();
    for (std::size_t i = 0; i < left.size(); ++i)
      left[i] = right[i] =
          static_cast<float>(0.5 * std::cos(2 * std::numbers::pi * kTone_hz * static_cast<double>(at + i) / 48000));
    frames += left.size();
  }
};

// A tone in the sink, steady before the test begins.
class RecordCommand : public testing::Test {
 protected:
  void SetUp() override {
    auto output = open_output({.kind = OutputKind::pulse}, tone_);
    ASSERT_TRUE(output) << output.error().message;
    output_ = std::move(*output);
    ASSERT_TRUE(output_->start());
    // The null sink may stall for 1.5 s at its start.
    ASSERT_TRUE(test::wait_until([&] { return tone_.frames > 120000; }, 30s));
  }
  void TearDown() override { output_->stop(); }

  test::RunResult record(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "record");
    return test::run(test::program("osteon-audio"), arguments, 60s);
  }
  std::string file() const { return (temp_ / "x.wav").string(); }

  SteadyTone tone_;
  std::unique_ptr<AudioOutput> output_;
  test::TempDir temp_;
};

// A busy machine makes gaps in the sink. The longest half second without one is what counts.
sound::Tone heard(const sound::WavSound& sound) {
  const auto half = static_cast<std::size_t>(sound.rate_hz / 2);
  sound::Tone best{};
  best.level_db = -200;
  for (std::size_t at = 0; at + half <= sound.samples.size(); at += half / 2) {
    const auto tone =
        sound::find_tone(std::span(sound.samples).subspan(at, half), sound.rate_hz, kTone_hz - 100, kTone_hz + 100);
    if (tone.level_db > best.level_db) best = tone;
  }
  return best;
}

TEST_F(RecordCommand, RecordsTheDefaultSource) {
  for (const char* bits : {"16", "24"}) {
    const auto ran = record({file(), "--seconds", "3", "--bits", bits, "--overwrite"});
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_THAT(ran.out, AllOf(HasSubstr("Monitor of Null Output"), HasSubstr("3.000 s"), HasSubstr("written")));
    const auto sound = sound::read_wav(file());
    ASSERT_TRUE(sound) << sound.error().message;
    EXPECT_EQ(sound->bits, std::atoi(bits));
    EXPECT_EQ(sound->rate_hz, 48000);
    EXPECT_EQ(sound->samples.size(), 144000U);
    const sound::Tone tone = heard(*sound);
    EXPECT_NEAR(tone.hz, kTone_hz, 1);
    EXPECT_NEAR(tone.level_db, 20 * std::log10(0.5), 1);
  }
}

TEST_F(RecordCommand, AnotherRateAndTwoChannels) {
  const auto ran =
      record({file(), "--seconds", "2", "--rate", "44100", "--channels", "2", "--device", "Monitor of Null"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const auto sound = sound::read_wav(file(), {.channel = sound::Channel::right});
  ASSERT_TRUE(sound) << sound.error().message;
  EXPECT_EQ(sound->channels, 2);
  EXPECT_EQ(sound->samples.size(), 88200U);
  EXPECT_NEAR(heard(*sound).hz, kTone_hz, 1);
}

TEST_F(RecordCommand, AnInterruptKeepsTheFile) {
  test::Process audio(test::program("osteon-audio"), {"record", file()});
  const auto partial = temp_ / ("x.wav.partial-" + std::to_string(audio.pid()));
  std::error_code none;
  ASSERT_TRUE(test::wait_until([&] { return std::filesystem::file_size(partial, none) > 100'000 && !none; }, 30s))
      << audio.err();
  audio.signal(SIGINT);
  EXPECT_EQ(audio.wait(30s), 0) << audio.err();
  const auto sound = sound::read_wav(file());
  ASSERT_TRUE(sound) << sound.error().message;
  EXPECT_GT(sound->seconds(), 0.5);
  EXPECT_NEAR(heard(*sound).hz, kTone_hz, 1);
  EXPECT_FALSE(std::filesystem::exists(partial));
}

TEST_F(RecordCommand, NeverLosesAFileThatIsThere) {
  ASSERT_TRUE(write_file(file(), "an operation that nobody can repeat"));
  const auto ran = record({file(), "--seconds", "1"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("x.wav is already there"), HasSubstr("--overwrite")));
  EXPECT_EQ(*read_file(file()), "an operation that nobody can repeat");
}

// Of two recorders on one new name, both keep what they heard.
TEST_F(RecordCommand, NeverLosesAFileThatCameMeanwhile) {
  test::Process audio(test::program("osteon-audio"), {"record", file(), "--seconds", "2"});
  const auto partial = temp_ / ("x.wav.partial-" + std::to_string(audio.pid()));
  ASSERT_TRUE(test::wait_until([&] { return std::filesystem::exists(partial); }, 30s)) << audio.err();
  ASSERT_TRUE(write_file(file(), "an operation that nobody can repeat"));
  EXPECT_EQ(audio.wait(60s), 1);
  EXPECT_THAT(audio.err(),
              AllOf(HasSubstr("another program made " + file()), HasSubstr(partial.string() + " has the sound")));
  EXPECT_EQ(*read_file(file()), "an operation that nobody can repeat");
  const auto sound = sound::read_wav(partial);
  ASSERT_TRUE(sound) << sound.error().message;
  EXPECT_NEAR(sound->seconds(), 2.0, 0.001);
}

// A file that is not there cannot be lost: what came until the disk was full gets the name.
TEST_F(RecordCommand, AFullDiskKeepsWhatCame) {
  const auto ran = test::run("bash", {"-c", "ulimit -f 256 && exec \"$@\"", "record",
                                      test::program("osteon-audio").string(), "record", file(), "--seconds", "20"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("File too large"), HasSubstr("x.wav has what came until then")));
  const auto sound = sound::read_wav(file());
  ASSERT_TRUE(sound) << sound.error().message;
  EXPECT_NEAR(sound->seconds(), 256 * 1024 / (3 * 48000.0), 0.05);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(temp_.path()), {}), 1);
}

TEST_F(RecordCommand, SaysWhereTheSourcesAreListed) {
  const auto ran = record({file(), "--seconds", "1", "--device", "theatre 7"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("there is no source \"theatre 7\""), HasSubstr("osteon-audio devices")));
  EXPECT_FALSE(std::filesystem::exists(file()));
  const auto listed = test::run(test::program("osteon-audio"), {"devices"});
  EXPECT_EQ(listed.exit_code, 0) << listed.err;
  const std::string& text = listed.out;
  const std::size_t sources = text.find("sources, to record from:\n");
  ASSERT_NE(sources, std::string::npos) << text;
  EXPECT_TRUE(text.starts_with("sinks, to play to:\n"));
  EXPECT_THAT(text.substr(0, sources), AllOf(HasSubstr("Hz  Null Output\n"), testing::Not(HasSubstr("Monitor"))));
  EXPECT_THAT(text.substr(sources), HasSubstr("*  0   2 channels   48000 Hz  Monitor of Null Output\n"));
}

TEST_F(RecordCommand, SaysThatNoServerAnswers) {
  const auto ran = test::run(test::program("osteon-audio"), {"record", file(), "--seconds", "1"}, 60s,
                             {.environment = {{"PULSE_SERVER", "unix:/nowhere"}}, .without = {}, .folder = {}});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("no source of sound answers"), HasSubstr("start PulseAudio")));
  EXPECT_FALSE(std::filesystem::exists(file()));
}

// The last one: it ends the server of deploy/with-null-sink. A recording is no longer than the time that it took. One
// that was not finished replaces nothing.
TEST_F(RecordCommand, WithoutItsServerNoSoundIsMadeUpAndNoneIsLost) {
  ASSERT_TRUE(write_file(file(), "an operation that nobody can repeat"));
  const auto begin = std::chrono::steady_clock::now();
  test::Process audio(test::program("osteon-audio"), {"record", file(), "--overwrite"});
  const auto partial = temp_ / ("x.wav.partial-" + std::to_string(audio.pid()));
  std::error_code none;
  ASSERT_TRUE(test::wait_until([&] { return std::filesystem::file_size(partial, none) > 100'000 && !none; }, 30s))
      << audio.err();
  EXPECT_EQ(test::run("pactl", {"exit"}).exit_code, 0);
  EXPECT_EQ(audio.wait(30s), 1);
  EXPECT_THAT(audio.err(),
              AllOf(HasSubstr(partial.string() + " has what came until then"), HasSubstr(file() + " is as it was")));
  EXPECT_EQ(*read_file(file()), "an operation that nobody can repeat");
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const auto sound = sound::read_wav(partial);
  ASSERT_TRUE(sound) << sound.error().message;
  EXPECT_GT(sound->seconds(), 0.5);
  EXPECT_LT(sound->seconds(), took.count());
}

}  // namespace
}  // namespace osteon::audio
