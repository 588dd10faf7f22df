// WAV files: what is written is read again, foreign files are refused by one sentence, and rates are converted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sndfile.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <tuple>

#include "common/sound/levels.hpp"
#include "common/sound/resample.hpp"
#include "common/sound/tones.hpp"
#include "common/sound/wav_file.hpp"
#include "common/sound/wav_writer.hpp"
#include "tests/support/content.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::sound {
namespace {

namespace fs = std::filesystem;

void write_foreign(const fs::path& file, int format, int channels, int rate_hz, std::span<const float> frames) {
  SF_INFO info{};
  info.samplerate = rate_hz;
  info.channels = channels;
  info.format = format;
  SNDFILE* out = sf_open(file.c_str(), SFM_WRITE, &info);
  ASSERT_NE(out, nullptr) << sf_strerror(nullptr);
  sf_writef_float(out, frames.data(), static_cast<sf_count_t>(frames.size()) / channels);
  sf_close(out);
}

void put(const fs::path& file, std::string_view bytes) {
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

constexpr int kPcm16 = SF_FORMAT_WAV | SF_FORMAT_PCM_16, kFloat = SF_FORMAT_WAV | SF_FORMAT_FLOAT;

TEST(WavFile, WhatIsWrittenIsRead) {
  const test::TempDir temp;
  const std::vector<float> samples = tone(440, 0.5, 22050, 22050);
  ASSERT_TRUE(write_wav(temp / "a.wav", samples, 22050));
  const auto read = read_wav(temp / "a.wav");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->rate_hz, 22050);
  EXPECT_EQ(read->channels, 1);
  EXPECT_EQ(read->bits, 16);
  EXPECT_DOUBLE_EQ(read->seconds(), 1.0);
  ASSERT_EQ(read->samples.size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_NEAR(read->samples[i], samples[i], 1.1 / 32768);
}

TEST(WavFile, BeyondFullScaleIsClipped) {
  const test::TempDir temp;
  ASSERT_TRUE(write_wav(temp / "a.wav", std::vector<float>(22050, 1.7F), 22050));
  const auto read = read_wav(temp / "a.wav");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_NEAR(read->samples[100], 1.0F, 1e-4F);
}

// A sine of amplitude A stays beyond 1 for 1 - 2 asin(1 / A) / pi of the time. One sample at full scale is no clipping.
TEST(WavFile, CountsWhatIsClipped) {
  const test::TempDir temp;
  const std::vector<float> loud = tone(110, 2.0, 44100, 44100), quiet = tone(110, 0.9, 44100, 44100);
  std::vector<float> both, peak = quiet;
  for (std::size_t i = 0; i < loud.size(); ++i)
    both.push_back(std::clamp(loud[i], -1.0F, 1.0F)), both.push_back(quiet[i]);
  peak[500] = 1.0F, peak[9000] = -1.0F;
  const double wanted = 44100 * (1 - 2 * std::asin(1 / 2.0) / std::numbers::pi);
  for (const int format : {SF_FORMAT_WAV | SF_FORMAT_PCM_U8, kPcm16, SF_FORMAT_WAV | SF_FORMAT_PCM_24, kFloat}) {
    write_foreign(temp / "a.wav", format, 2, 44100, both);
    const auto clipped = [&](const char* file, Channel channel, double from_s = 0) {
      const auto read = read_wav(temp / file, {.channel = channel, .from_s = from_s});
      return read ? static_cast<double>(read->clipped) : -1.0;
    };
    // The sine is beyond 1 in 220 half waves. Both edges of each are between two samples, and 8 bits round a little
    // more to the last value.
    const double rounded = 2 * 220;
    EXPECT_NEAR(clipped("a.wav", Channel::left), wanted, rounded);
    EXPECT_EQ(clipped("a.wav", Channel::right), 0);
    EXPECT_NEAR(clipped("a.wav", Channel::mean), wanted, rounded) << "one of its channels";
    EXPECT_NEAR(clipped("a.wav", Channel::left, 0.5), wanted / 2, rounded) << "of the part";
    write_foreign(temp / "peak.wav", format, 1, 44100, peak);
    EXPECT_EQ(clipped("peak.wav", Channel::left), 0);
  }
}

TEST(WavFile, DepthsAndChannels) {
  const test::TempDir temp;
  std::vector<float> frames;
  for (int i = 0; i < 22050; ++i) frames.push_back(0.25F), frames.push_back(-0.75F);
  for (const auto& [format, bits] :
       {std::pair{kPcm16, 16}, std::pair{SF_FORMAT_WAV | SF_FORMAT_PCM_24, 24},
        std::pair{SF_FORMAT_WAVEX | SF_FORMAT_PCM_32, 32}, std::pair{kFloat, 32},
        std::pair{SF_FORMAT_WAV | SF_FORMAT_DOUBLE, 64}, std::pair{SF_FORMAT_RF64 | SF_FORMAT_PCM_16, 16}}) {
    write_foreign(temp / "a.wav", format, 2, 44100, frames);
    for (const auto& [channel, value] :
         {std::pair{Channel::left, 0.25F}, std::pair{Channel::right, -0.75F}, std::pair{Channel::mean, -0.25F}}) {
      const auto read = read_wav(temp / "a.wav", {.channel = channel});
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ(read->bits, bits);
      EXPECT_EQ(read->floating, format == kFloat || bits == 64);
      EXPECT_FALSE(read->announced_s);
      EXPECT_EQ(read->channels, 2);
      ASSERT_EQ(read->samples.size(), 22050U);
      EXPECT_NEAR(read->samples[77], value, 1e-4F);
    }
  }
}

TEST(WavFile, RefusesWhatItCannotUse) {
  const test::TempDir temp;
  std::vector<float> second(44100, 0.1F);
  second[44001] = 0.2F;  // in one channel only
  write_foreign(temp / "stereo.wav", kPcm16, 2, 22050, second);
  write_foreign(temp / "six.wav", kPcm16, 6, 22050, second);
  write_foreign(temp / "mulaw.wav", SF_FORMAT_WAV | SF_FORMAT_ULAW, 1, 44100, second);
  write_foreign(temp / "fast.wav", kPcm16, 1, 400000, second);
  std::vector<float> broken = second;
  broken[1000] = std::numeric_limits<float>::quiet_NaN();
  write_foreign(temp / "nan.wav", kFloat, 1, 44100, broken);
  broken[1000] = -std::numeric_limits<float>::infinity();
  write_foreign(temp / "infinite.wav", SF_FORMAT_WAV | SF_FORMAT_DOUBLE, 1, 44100, broken);
  write_foreign(temp / "8k.wav", kPcm16, 1, 8000, second);
  write_foreign(temp / "none.wav", kPcm16, 1, 44100, {});
  write_foreign(temp / "short.wav", kPcm16, 1, 44100, std::span(second).first(4410));
  write_foreign(temp / "long.wav", kPcm16, 1, 22050, std::vector<float>(301 * 22050, 0.0F));
  write_foreign(temp / "aiff.wav", SF_FORMAT_AIFF | SF_FORMAT_PCM_16, 1, 44100, second);
  write_foreign(temp / "whole.wav", kPcm16, 1, 44100, second);
  const std::string whole = test::content(temp / "whole.wav");
  put(temp / "cut.wav", whole.substr(0, 20000));
  put(temp / "zeros.wav", whole.substr(0, 12) + std::string(8 * 1001, '\0') + whole.substr(12));
  ASSERT_EQ(mkfifo((temp / "pipe.wav").c_str(), 0600), 0);
  put(temp / "header.wav", whole.substr(0, 30));
  put(temp / "letters.wav", whole.substr(0, 3));
  put(temp / "empty.wav", "");
  put(temp / "text.wav", "time_s,level\n0,1\n");
  fs::create_directory(temp / "folder.wav");

  struct Wrong {
    const char* file;
    std::vector<std::string> says;
  };
  const std::vector<Wrong> cases = {
      {"nothing.wav", {"there is no file", "give the path"}},
      {"folder.wav", {"folder"}},
      {"stereo.wav", {"NumChannels is 2", "--channel"}},
      {"six.wav", {"NumChannels is 6", "its number"}},
      {"mulaw.wav", {"AudioFormat", "PCM WAV"}},
      {"fast.wav", {"SampleRate is 400000", "384000", "44100"}},
      {"8k.wav", {"SampleRate is 8000", "11025 Hz"}},
      {"nan.wav", {"sample 1000 is not a number", "export it again"}},
      {"infinite.wav", {"sample 1000 is far beyond full scale", "export it again"}},
      {"zeros.wav", {"truncated", "fmt "}},
      {"pipe.wav", {"pipe"}},
      {"none.wav", {"empty", "Subchunk2Size"}},
      {"short.wav", {"0.1 s", "at least 0.25 s"}},
      {"long.wav", {"301 s", "at most 300 s", "--from and --to"}},
      {"aiff.wav", {"ChunkID", "convert"}},
      {"cut.wav", {"0.2263 s", "at least 0.25 s"}},
      {"header.wav", {"truncated"}},
      {"letters.wav", {"no WAV file"}},
      {"empty.wav", {"empty", "no byte"}},
      {"text.wav", {"no WAV file", "ChunkID", "convert"}},
  };
  for (const Wrong& wrong : cases) {
    const auto read = read_wav(temp / wrong.file);
    ASSERT_FALSE(read) << wrong.file;
    EXPECT_THAT(read.error().message, testing::HasSubstr(wrong.file));
    for (const std::string& words : wrong.says) EXPECT_THAT(read.error().message, testing::HasSubstr(words));
    EXPECT_EQ(std::ranges::count(read.error().message, '\n'), 0);
  }
}

TEST(WavFile, APlaceThatCannotBeWrittenIsNamed) {
  const auto written = write_wav("/nowhere/a.wav", std::vector<float>(100, 0.0F), 22050);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, testing::HasSubstr("/nowhere/a.wav"));
}

// A full disk: while it lives, no file of this program grows beyond kBytes.
class FullDisk {
 public:
  FullDisk() : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &before_), 0);
    rlimit limit = before_;
    limit.rlim_cur = kBytes;
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

  // A header of 44 bytes, samples of 3 bytes, and a part of the next one.
  static constexpr std::size_t kSamples = 20000, kBytes = 44 + 3 * kSamples + 2;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

constexpr WavFormat kRecording{.rate_hz = 22050, .channels = 1, .bits = 24};

Result<void> write_in_pieces(WavWriter& writer, std::span<const float> samples) {
  constexpr std::size_t kPiece = 1500;  // samples
  Result<void> written;
  for (std::size_t at = 0; at < samples.size() && written; at += kPiece)
    written = writer.write(samples.subspan(at, std::min(kPiece, samples.size() - at)));
  return written;
}

TEST(WavWriter, KeepsWhatAFullDiskTook) {
  const test::TempDir temp;
  const fs::path file = temp / "a.wav";
  const std::vector<float> samples = tone(440, 0.5, 2 * FullDisk::kSamples, 22050);
  auto writer = WavWriter::open(file, kRecording, Unfinished::kept);
  ASSERT_TRUE(writer) << writer.error().message;
  Result<void> written, closed;
  {
    const FullDisk disk;
    written = write_in_pieces(*writer, samples);
  }
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, testing::HasSubstr(file.string()));
  EXPECT_THAT(written.error().message, testing::Not(testing::HasSubstr("as it was")));
  EXPECT_FALSE(writer->write(samples)) << "there is room again, but a part of a sample is before it";
  {
    const FullDisk disk;
    closed = writer->close();
  }
  ASSERT_TRUE(closed) << closed.error().message;
  EXPECT_EQ(writer->frames(), FullDisk::kSamples);
  EXPECT_EQ(test::names_in(temp.path()), std::set<std::string>{"a.wav"});
  const auto read = read_wav(file);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_FALSE(read->announced_s);
  ASSERT_EQ(read->samples.size(), FullDisk::kSamples);
  for (std::size_t i = 0; i < read->samples.size(); ++i) ASSERT_NEAR(read->samples[i], samples[i], 1e-6) << i;
}

TEST(WavWriter, WhatCanBeMadeAgainLeavesAFullDiskAsItWas) {
  const test::TempDir temp;
  const fs::path file = temp / "a.wav";
  put(file, "older");
  {
    auto writer = WavWriter::open(file, kRecording);
    ASSERT_TRUE(writer) << writer.error().message;
    const FullDisk disk;
    const auto written = write_in_pieces(*writer, tone(440, 0.5, 2 * FullDisk::kSamples, 22050));
    const auto closed = writer->close();
    for (const Result<void>& result : {written, closed}) {
      ASSERT_FALSE(result);
      EXPECT_THAT(result.error().message, testing::HasSubstr("as it was"));
    }
  }
  EXPECT_EQ(test::content(file), "older");
  EXPECT_EQ(test::names_in(temp.path()), std::set<std::string>{"a.wav"});
}

TEST(WavWriter, WhatIsKeptAndCannotGetItsNameIsLeftAndNamed) {
  const test::TempDir temp;
  const fs::path file = temp / "a.wav", partial = temp / ("a.wav.partial-" + std::to_string(::getpid()));
  const std::vector<float> samples = tone(440, 0.5, 22050, 22050);
  {
    auto writer = WavWriter::open(file, kRecording, Unfinished::kept);
    ASSERT_TRUE(writer) << writer.error().message;
    ASSERT_TRUE(writer->write(samples));
    ASSERT_TRUE(fs::create_directory(file));
    const auto closed = writer->close();
    ASSERT_FALSE(closed);
    EXPECT_THAT(closed.error().message, testing::HasSubstr(partial.string() + " has what came until then"));
  }
  const auto read = read_wav(partial);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->samples.size(), samples.size());
}

TEST(WavWriter, ReplacesNoFileThatWasMadeMeanwhile) {
  const test::TempDir temp;
  const fs::path file = temp / "a.wav", partial = temp / ("a.wav.partial-" + std::to_string(::getpid()));
  const std::vector<float> samples = tone(440, 0.5, 22050, 22050);
  {
    auto writer = WavWriter::open(file, kRecording, Unfinished::kept, Older::kept);
    ASSERT_TRUE(writer) << writer.error().message;
    ASSERT_TRUE(writer->write(samples));
    put(file, "of another recorder");
    const auto closed = writer->close();
    ASSERT_FALSE(closed);
    EXPECT_EQ(closed.error().code, ErrorCode::exists);
    EXPECT_THAT(closed.error().message, testing::AllOf(testing::HasSubstr("another program made " + file.string()),
                                                       testing::HasSubstr(partial.string() + " has the sound")));
  }
  EXPECT_EQ(test::content(file), "of another recorder");
  const auto read = read_wav(partial);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->samples.size(), samples.size());
}

TEST(WavWriter, ThatReplacesNothingGivesANewFileItsName) {
  const test::TempDir temp;
  auto writer = WavWriter::open(temp / "a.wav", kRecording, Unfinished::kept, Older::kept);
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE(writer->write(tone(440, 0.5, 22050, 22050)));
  const auto closed = writer->close();
  ASSERT_TRUE(closed) << closed.error().message;
  EXPECT_EQ(test::names_in(temp.path()), std::set<std::string>{"a.wav"});
}

TEST(WavFile, OfACutFileIsReadWhatIsThere) {
  const test::TempDir temp;
  ASSERT_TRUE(write_wav(temp / "whole.wav", tone(440, 0.5, 8000, 22050), 22050));
  const std::string whole = test::content(temp / "whole.wav");
  const auto all = read_wav(temp / "whole.wav");
  ASSERT_TRUE(all);
  for (std::size_t bytes = 0; bytes < whole.size(); bytes += bytes < 60 ? 1 : 997) {
    put(temp / "cut.wav", whole.substr(0, bytes));
    const auto read = read_wav(temp / "cut.wav");
    // Of 0.25 s at least.
    ASSERT_EQ(read.has_value(), bytes >= 44 + 2 * 5513) << bytes;
    if (!read) continue;
    ASSERT_EQ(read->samples.size(), (bytes - 44) / 2);
    EXPECT_TRUE(std::ranges::equal(read->samples, std::span(all->samples).first(read->samples.size())));
    EXPECT_NEAR(read->announced_s.value_or(-1), 8000.0 / 22050, 1e-9);
    EXPECT_DOUBLE_EQ(read->file_s, read->seconds());
  }
  EXPECT_FALSE(all->announced_s);
}

// libsndfile calls such a file an error of its own.
TEST(WavFile, ADamagedHeaderIsNamed) {
  const test::TempDir temp;
  ASSERT_TRUE(write_wav(temp / "a.wav", tone(440, 0.5, 8000, 22050), 22050));
  const std::string whole = test::content(temp / "a.wav");
  for (const std::size_t at : {22U, 24U}) {  // NumChannels, SampleRate
    std::string damaged = whole;
    damaged.replace(at, 2, std::string(2, '\0'));
    put(temp / "b.wav", damaged);
    const auto read = read_wav(temp / "b.wav");
    ASSERT_FALSE(read) << at;
    EXPECT_THAT(read.error().message,
                testing::AllOf(testing::HasSubstr((temp / "b.wav").string()), testing::ContainsRegex("convert|record"),
                               testing::Not(testing::HasSubstr("rror :"))));
  }
}

TEST(WavFile, ASizeThatNobodyWroteIsThatOfTheFile) {
  const test::TempDir temp;
  const std::vector<float> samples = tone(440, 0.5, 22050, 22050);
  write_foreign(temp / "plain.wav", kPcm16, 1, 22050, samples);
  write_foreign(temp / "long.wav", SF_FORMAT_RF64 | SF_FORMAT_PCM_16, 1, 22050, samples);
  for (const char* file : {"plain.wav", "long.wav"})
    for (const std::string& size : {std::string(4, '\0'), std::string(4, '\xFF')}) {
      std::string changed = test::content(temp / file);
      // RF64 has the true size in ds64, so 0xFFFFFFFF is its usual value.
      const bool usual = std::string_view(file) == "long.wav" && size[0] != 0;
      changed.replace(changed.find("data") + 4, 4, size);
      put(temp / "changed.wav", changed);
      const auto read = read_wav(temp / "changed.wav");
      ASSERT_TRUE(read) << file << ": " << read.error().message;
      ASSERT_EQ(read->samples.size(), samples.size()) << file;
      EXPECT_NEAR(read->samples[100], samples[100], 1.1 / 32768);
      EXPECT_EQ(read->announced_s.has_value(), !usual) << file;
      EXPECT_EQ(read->announced_s.value_or(0), 0.0);
    }
  // A long file that was cut: its ds64 still has the whole size.
  const std::string whole = test::content(temp / "long.wav");
  put(temp / "cut.wav", whole.substr(0, whole.size() - 22050));
  const auto cut = read_wav(temp / "cut.wav");
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_NEAR(cut->seconds(), 0.5, 1e-9);
  EXPECT_NEAR(cut->announced_s.value_or(-1), 1.0, 1e-9);
}

TEST(WavFile, APartIsWhatItsTimesSay) {
  const test::TempDir temp;
  // More than a block of frames, in three channels of which the second one rises.
  constexpr std::size_t kFrames = 150000;
  std::vector<float> frames;
  for (std::size_t i = 0; i < kFrames; ++i) frames.insert(frames.end(), {0.5F, static_cast<float>(i) / kFrames, -0.5F});
  write_foreign(temp / "a.wav", kFloat, 3, 50000, frames);
  const auto part = read_wav(temp / "a.wav", {.channel = channel_of("2"), .from_s = 0.5, .to_s = 2.9});
  ASSERT_TRUE(part) << part.error().message;
  ASSERT_EQ(part->samples.size(), 120000U);
  EXPECT_EQ(part->samples.front(), 25000.0F / kFrames);
  EXPECT_EQ(part->samples.back(), 144999.0F / kFrames);
  EXPECT_DOUBLE_EQ(part->from_s, 0.5);
  EXPECT_DOUBLE_EQ(part->file_s, 3.0);
  const auto rest = read_wav(temp / "a.wav", {.channel = channel_of("2"), .from_s = 2.5});
  ASSERT_TRUE(rest) << rest.error().message;
  EXPECT_DOUBLE_EQ(rest->seconds(), 0.5);
  const auto mean = read_wav(temp / "a.wav", {.channel = Channel::mean});
  ASSERT_TRUE(mean) << mean.error().message;
  EXPECT_NEAR(mean->samples[75000], 0.5 / 3, 1e-6);

  const std::vector<std::pair<WavPart, const char*>> wrong = {
      {{.channel = Channel::left, .from_s = 2.9}, "the part lasts 0.1 s"},
      {{.channel = Channel::left, .from_s = 4}, "within its 3 s"},
      {{.channel = Channel::left, .from_s = 2, .to_s = 1}, "in this order"},
      {{.channel = Channel::left, .from_s = 0, .to_s = 3.1}, "within its 3 s"},
      {{.channel = channel_of("4")}, "without a channel 4"},
      {{.channel = {}}, "--channel"}};
  for (const auto& [asked, says] : wrong) {
    const auto read = read_wav(temp / "a.wav", asked);
    ASSERT_FALSE(read) << says;
    EXPECT_THAT(read.error().message, testing::HasSubstr(says));
  }
  for (const char* word : {"0", "65", "-1", "1.5", "middle", ""}) EXPECT_FALSE(channel_of(word)) << word;
}

TEST(WavFile, EqualChannelsAreOne) {
  const test::TempDir temp;
  std::vector<float> frames;
  for (int i = 0; i < 22050; ++i) frames.insert(frames.end(), 2, static_cast<float>(i) / 22050);
  write_foreign(temp / "a.wav", kPcm16, 2, 22050, frames);
  const auto read = read_wav(temp / "a.wav");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->samples.size(), 22050U);
  EXPECT_NEAR(read->samples[11025], 0.5, 1e-4);
}

TEST(WavFile, EightBitsAndHighRatesAreRead) {
  const test::TempDir temp;
  write_foreign(temp / "8bit.wav", SF_FORMAT_WAV | SF_FORMAT_PCM_U8, 1, 44100, tone(440, 0.5, 44100, 44100));
  const auto coarse = read_wav(temp / "8bit.wav");
  ASSERT_TRUE(coarse) << coarse.error().message;
  EXPECT_EQ(coarse->bits, 8);
  EXPECT_NEAR(rms_db(coarse->samples), 20 * std::log10(0.5) - 3.01, 0.1);
  for (const int rate_hz : {96000, 192000, 384000}) {
    write_foreign(temp / "fast.wav", kPcm16, 1, rate_hz,
                  tone(440, 0.5, static_cast<std::size_t>(rate_hz) / 2, rate_hz));
    const auto read = read_wav(temp / "fast.wav");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->rate_hz, rate_hz);
    EXPECT_DOUBLE_EQ(read->seconds(), 0.5);
  }
}

TEST(WavFile, ChangedBytesOfTheHeaderDoNoHarm) {
  const test::TempDir temp;
  ASSERT_TRUE(write_wav(temp / "whole.wav", tone(440, 0.5, 8000, 22050), 22050));
  const std::string whole = test::content(temp / "whole.wav");
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    std::string changed = whole;
    for (int k = 0; k < 3; ++k) changed[random() % 64] = static_cast<char>(random());
    put(temp / "changed.wav", changed);
    const auto read = read_wav(temp / "changed.wav", {.channel = Channel::mean});
    if (!read) {
      EXPECT_EQ(std::ranges::count(read.error().message, '\n'), 0) << read.error().message;
      continue;
    }
    EXPECT_LE(read->samples.size(), 16000U);  // of 8 bits
    for (const float x : read->samples) ASSERT_TRUE(std::isfinite(x));
  }
}

TEST(Resample, AToneStaysAsItIsAndDoesNotMove) {
  for (const double from_hz : {44100.0, 48000.0, 96000.0, 192000.0}) {
    const std::vector<float> result = resampled(tone(3000, 0.5, 48000, from_hz), from_hz, 22050);
    EXPECT_EQ(result.size(), static_cast<std::size_t>(std::llround(48000 * 22050 / from_hz)));
    const std::vector<float> expected = tone(3000, 0.5, result.size(), 22050);
    ASSERT_GT(result.size(), 2000U);
    for (std::size_t i = 500; i + 500 < result.size(); ++i) ASSERT_NEAR(result[i], expected[i], 1e-4) << i;
  }
}

TEST(Resample, WhatTheNewRateCannotHaveIsGone) {
  // A "medium" sinc needs 10 % of the band for its slope: what lies up to 12.1 kHz comes back weaker, below 11 kHz.
  for (const auto& [rate_hz, hz, most_db] :
       {std::tuple{48000.0, 13000.0, -100.0}, std::tuple{96000.0, 30000.0, -100.0},
        std::tuple{192000.0, 60000.0, -100.0}, std::tuple{48000.0, 12300.0, -80.0}}) {
    const std::vector<float> result =
        resampled(tone(hz, 0.5, static_cast<std::size_t>(rate_hz), rate_hz), rate_hz, 22050);
    EXPECT_LT(rms_db(std::span(result).subspan(500, result.size() - 1000)), most_db) << hz;
  }
}

TEST(Resample, RatiosBeyondTheLibrarysAreABrokenPromise) {
  const std::vector<float> sound(100, 0.1F);
  EXPECT_DEATH(static_cast<void>(resampled(sound, 257.0 * 22050, 22050)), "ratio");
}

TEST(Resample, SameRateSameSamples) {
  const std::vector<float> noise = white_noise(0.1, 1000, 1);
  EXPECT_EQ(resampled(noise, 22050, 22050), noise);
  EXPECT_TRUE(resampled({}, 44100, 22050).empty());
}

}  // namespace
}  // namespace osteon::sound
