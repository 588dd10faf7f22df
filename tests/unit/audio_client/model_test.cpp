// osteon-audio model and resynthesise: what they print and write, and what they say to wrong use.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "audio_client/analysis/model_report.hpp"
#include "common/sound/wav_file.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::audio {
namespace {

namespace fs = std::filesystem;

class ModelProgram : public testing::Test {
 protected:
  ModelProgram() {
    // Two seconds of a line in noise at 44.1 kHz.
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0.0F, 0.02F);
    std::vector<float> samples;
    for (int i = 0; i < 88200; ++i)
      samples.push_back(0.2F * static_cast<float>(std::sin(0.2 * static_cast<double>(i))) + noise(random));
    EXPECT_TRUE(sound::write_wav(wav(), samples, 44100));
  }
  [[nodiscard]] fs::path wav() const { return temp_ / "drill.wav"; }
  [[nodiscard]] std::string path(const char* name) const { return (temp_ / name).string(); }
  [[nodiscard]] static test::RunResult run(const std::vector<std::string>& arguments) {
    return test::run(test::program("osteon-audio"), arguments);
  }

  test::TempDir temp_;
};

TEST_F(ModelProgram, ItsFileSoundsAsWhatItPlays) {
  const test::RunResult made =
      run({"model", wav().string(), "--out", path("a.model"), "--play", path("a.wav"), "--seed", "3"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out,
              testing::AllOf(testing::HasSubstr("2.00 s"), testing::HasSubstr("mel_lsd_db"),
                             testing::HasSubstr("the model, no phases"), testing::HasSubstr("times as fast")));
  const test::RunResult again = run({"resynthesise", path("a.model"), path("b.wav"), "--seed", "3"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(test::content(temp_ / "a.wav"), test::content(temp_ / "b.wav"));
  ASSERT_EQ(run({"resynthesise", path("a.model"), path("c.wav"), "--seed", "4"}).exit_code, 0);
  EXPECT_NE(test::content(temp_ / "a.wav"), test::content(temp_ / "c.wav"));

  const auto sound = sound::read_wav(temp_ / "a.wav");
  ASSERT_TRUE(sound) << sound.error().message;
  EXPECT_EQ(sound->rate_hz, 22050);
  EXPECT_NEAR(sound->seconds(), 2.0, 0.001);
  const auto model = read_model(path("a.model"));
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->samples, sound->samples.size());
}

TEST_F(ModelProgram, ModelsThePartThatIsAskedFor) {
  const test::RunResult part = run({"model", wav().string(), "--from", "0.5", "--to", "1.75", "--play", path("a.wav")});
  ASSERT_EQ(part.exit_code, 0) << part.err;
  const auto sound = sound::read_wav(temp_ / "a.wav");
  ASSERT_TRUE(sound) << sound.error().message;
  EXPECT_NEAR(sound->seconds(), 1.25, 0.001);
}

// Whatever is made of a recording, its user hears what is wrong with it.
TEST_F(ModelProgram, SaysWhatIsWrongWithTheRecording) {
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0.0F, 0.02F);
  std::vector<float> loud;
  for (int i = 0; i < 88200; ++i)
    loud.push_back(2.0F * static_cast<float>(std::sin(0.2 * static_cast<double>(i))) + noise(random));
  ASSERT_TRUE(sound::write_wav(temp_ / "loud.wav", loud, 44100));
  const auto put = [&](const char* name, const std::string& bytes) {
    std::ofstream(temp_ / name, std::ios::binary) << bytes;
    return path(name);
  };
  const std::string good = test::content(wav());
  std::string coarse = good;
  coarse[34] = 8, coarse[32] = 1;  // BitsPerSample, BlockAlign
  const std::string cut = put("cut.wav", good.substr(0, 44 + 2 * 44100)), eight = put("eight.wav", coarse);
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"analyse"}, {"model", "--refine", "0"}, {"preset", "--out", path("a.yaml"), "--rpm", "1400"}}) {
    const auto said = [&](const std::string& file) {
      std::vector<std::string> arguments = command;
      arguments.push_back(file);
      const test::RunResult result = run(arguments);
      EXPECT_EQ(result.exit_code, 0) << command.front() << ": " << result.err;
      return result.out;
    };
    EXPECT_THAT(said(cut), testing::HasSubstr("note       the header announces 2 s; 1 s are there\n"));
    EXPECT_THAT(said(eight), testing::HasSubstr("note       8 bits: their quantisation noise"));
    // Beyond full scale for two thirds of the time.
    EXPECT_THAT(said(path("loud.wav")), testing::ContainsRegex("note       5[89][0-9]* samples .67 %. stay at full"));
    EXPECT_THAT(said(wav().string()), testing::Not(testing::HasSubstr("note")));
  }
}

TEST_F(ModelProgram, WrongUseIsOneSentenceEach) {
  ASSERT_EQ(run({"model", wav().string(), "--out", path("a.model")}).exit_code, 0);
  const std::string whole = test::content(temp_ / "a.model");
  const auto put = [&](const char* name, std::string_view bytes) {
    std::ofstream(temp_ / name, std::ios::binary) << bytes;
    return path(name);
  };
  std::string other = whole;
  other[8] = 9;
  fs::create_directory(temp_ / "folder");
  std::ofstream(temp_ / "huge.model").close();
  fs::resize_file(temp_ / "huge.model", 1ULL << 33U);
  struct Wrong {
    std::vector<std::string> arguments;
    std::vector<std::string> says;
  };
  const std::vector<Wrong> cases = {
      {{"model", "nothing.wav"}, {"nothing.wav", "give the path"}},
      {{"model"}, {"FILE"}},
      {{"model", path("a.model")}, {"a.model", "no WAV file"}},
      {{"model", wav().string(), "--refine", "-1"}, {"--refine"}},
      {{"model", wav().string(), "--channel", "middle"}, {"--channel", "middle"}},
      {{"model", wav().string(), "--from", "1.9"}, {"drill.wav", "the part lasts 0.1 s"}},
      {{"model", wav().string(), "--out", "/proc/nowhere/a.model"}, {"/proc/nowhere/a.model", "--out"}},
      {{"model", wav().string(), "--play", "/proc/nowhere/a.wav"}, {"/proc/nowhere/a.wav", "--play"}},
      {{"model", wav().string(), "--from", "nan"}, {"--from", "nan is not a number from 0 to 1000000"}},
      {{"model", wav().string(), "--to", "inf"}, {"--to", "inf is not a number from 0 to 1000000"}},
      {{"model", wav().string(), "--out", wav().string()}, {"drill.wav would lose what is read", "--out another"}},
      {{"model", wav().string(), "--play", path("./drill.wav")}, {"drill.wav would lose what is read", "--play"}},
      {{"model", wav().string(), "--out", path("b"), "--play", path("./b")}, {"b would lose the model", "--play"}},
      {{"model", wav().string(), "--out", path("pipe")}, {"pipe: it is a device or a pipe", "--out"}},
      {{"resynthesise", path("a.model"), path("a.model")}, {"a.model would lose what is read", "OUT another"}},
      {{"resynthesise", path("a.model"), path("pipe")}, {"pipe: it is a device or a pipe", "OUT"}},
      {{"resynthesise", path("pipe"), path("b.wav")}, {"pipe is a folder, a device or a pipe"}},
      {{"resynthesise", "/dev/zero", path("b.wav")}, {"/dev/zero is a folder, a device or a pipe"}},
      {{"resynthesise", path("a.model")}, {"OUT"}},
      {{"resynthesise", "nothing.model", path("b.wav")}, {"no file nothing.model", "osteon-audio model --out"}},
      {{"resynthesise", path("a.model"), ""}, {"OUT: the name is empty", "osteon-audio resynthesise --help"}},
      {{"model", wav().string(), "--out", ""}, {"--out: the name is empty", "osteon-audio model --help"}},
      {{"model", wav().string(), "--play", ""}, {"--play: the name is empty"}},
      {{"resynthesise", path("folder"), path("b.wav")}, {"folder"}},
      {{"resynthesise", path("huge.model"), path("b.wav")}, {"huge.model", "at most"}},
      {{"resynthesise", wav().string(), path("b.wav")}, {"drill.wav", "no spectral model"}},
      {{"resynthesise", put("cut.model", whole.substr(0, whole.size() / 2)), path("b.wav")}, {"cut.model", "damaged"}},
      {{"resynthesise", put("other.model", other), path("b.wav")}, {"other.model", "version is 9"}},
  };
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  const std::string recorded = test::content(wav());
  for (const Wrong& wrong : cases) {
    const test::RunResult result = run(wrong.arguments);
    EXPECT_EQ(result.exit_code, 1) << wrong.says.front();
    EXPECT_THAT(result.err, testing::StartsWith("osteon-audio: "));
    for (const std::string& words : wrong.says) EXPECT_THAT(result.err, testing::HasSubstr(words));
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }
  EXPECT_EQ(test::content(wav()), recorded);
  EXPECT_EQ(test::content(temp_ / "a.model"), whole);
  EXPECT_TRUE(fs::is_fifo(temp_ / "pipe"));
}

// A long sound whose peaks are refined again and again.
TEST_F(ModelProgram, AStopIsOneSentenceAndWritesNothing) {
  ASSERT_TRUE(sound::write_wav(temp_ / "long.wav", sound::white_noise(0.1, 22050 * 120, 1), 22050));
  const std::vector<std::pair<std::vector<std::string>, const char*>> cases = {
      {{"model", path("long.wav"), "--refine", "20", "--out", path("x"), "--play", path("x.wav")},
       "x.wav were not written"},
      {{"model", path("long.wav"), "--refine", "20"}, "nothing was written"},
      {{"preset", path("long.wav"), "--refine", "20", "--out", path("x")}, "x was not written"}};
  for (const auto& [arguments, says] : cases) {
    test::Process audio(test::program("osteon-audio"), arguments);
    ASSERT_TRUE(test::wait_until([&] { return audio.err().find("modelling: ") != std::string::npos; },
                                 std::chrono::seconds(60)))
        << audio.err();
    audio.signal(SIGINT);
    EXPECT_EQ(audio.wait(std::chrono::seconds(60)), 130) << says;
    EXPECT_THAT(audio.err(), testing::AllOf(testing::HasSubstr("osteon-audio: stopped; "), testing::HasSubstr(says)));
    EXPECT_EQ(audio.out(), "");
    for (const char* file : {"x", "x.wav"}) EXPECT_FALSE(fs::exists(temp_ / file)) << file;
  }
}

// What is read by another program may be a link to where it shall be.
TEST_F(ModelProgram, WritesWhereALinkPoints) {
  ASSERT_TRUE(fs::create_directory(temp_ / "elsewhere"));
  for (const char* name : {"a.model", "a.wav"}) {
    std::ofstream(temp_ / "elsewhere" / name) << "old";
    fs::create_symlink(temp_ / "elsewhere" / name, temp_ / name);
  }
  ASSERT_EQ(run({"model", wav().string(), "--out", path("a.model"), "--play", path("a.wav")}).exit_code, 0);
  for (const char* name : {"a.model", "a.wav"}) {
    EXPECT_TRUE(fs::is_symlink(temp_ / name)) << name;
    EXPECT_GT(fs::file_size(temp_ / "elsewhere" / name), 1000u) << name;
  }
}

}  // namespace
}  // namespace osteon::audio
