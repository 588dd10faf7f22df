// WAV files: what is written is read again, foreign files are refused by one sentence, and rates are converted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>

#include "common/sound/levels.hpp"
#include "common/sound/resample.hpp"
#include "common/sound/tones.hpp"
#include "common/sound/wav_file.hpp"
#include "tests/support/content.hpp"
#include "tests/support/shared_data.hpp"
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

constexpr int kPcm16 = SF_FORMAT_WAV | SF_FORMAT_PCM_16;

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

TEST(WavFile, DepthsAndChannels) {
  const test::TempDir temp;
  std::vector<float> frames;
  for (int i = 0; i < 22050; ++i) frames.push_back(0.25F), frames.push_back(-0.75F);
  for (const auto& [format, bits] : {std::pair{kPcm16, 16}, std::pair{SF_FORMAT_WAV | SF_FORMAT_PCM_24, 24},
                                     std::pair{SF_FORMAT_WAVEX | SF_FORMAT_PCM_32, 32}}) {
    write_foreign(temp / "a.wav", format, 2, 44100, frames);
    for (const auto& [channel, value] :
         {std::pair{Channel::left, 0.25F}, std::pair{Channel::right, -0.75F}, std::pair{Channel::mean, -0.25F}}) {
      const auto read = read_wav(temp / "a.wav", channel);
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ(read->bits, bits);
      EXPECT_EQ(read->channels, 2);
      ASSERT_EQ(read->samples.size(), 22050U);
      EXPECT_NEAR(read->samples[77], value, 1e-4F);
    }
  }
}

TEST(WavFile, RefusesWhatItCannotUse) {
  const test::TempDir temp;
  const std::vector<float> second(44100, 0.1F);
  write_foreign(temp / "stereo.wav", kPcm16, 2, 22050, second);
  write_foreign(temp / "six.wav", kPcm16, 6, 22050, second);
  write_foreign(temp / "8bit.wav", SF_FORMAT_WAV | SF_FORMAT_PCM_U8, 1, 44100, second);
  write_foreign(temp / "float.wav", SF_FORMAT_WAV | SF_FORMAT_FLOAT, 1, 44100, second);
  write_foreign(temp / "96k.wav", kPcm16, 1, 96000, second);
  write_foreign(temp / "8k.wav", kPcm16, 1, 8000, second);
  write_foreign(temp / "none.wav", kPcm16, 1, 44100, {});
  write_foreign(temp / "short.wav", kPcm16, 1, 44100, std::span(second).first(4410));
  write_foreign(temp / "long.wav", kPcm16, 1, 22050, std::vector<float>(301 * 22050, 0.0F));
  write_foreign(temp / "flac.wav", SF_FORMAT_AIFF | SF_FORMAT_PCM_16, 1, 44100, second);
  write_foreign(temp / "whole.wav", kPcm16, 1, 44100, second);
  const std::string whole = test::content(temp / "whole.wav");
  put(temp / "cut.wav", whole.substr(0, 40000));
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
      {"six.wav", {"NumChannels is 6"}},
      {"8bit.wav", {"BitsPerSample is 8", "16 bits"}},
      {"float.wav", {"AudioFormat", "PCM WAV"}},
      {"96k.wav", {"SampleRate is 96000", "44100"}},
      {"8k.wav", {"SampleRate is 8000"}},
      {"none.wav", {"empty", "Subchunk2Size"}},
      {"short.wav", {"0.1 s", "at least 0.25 s"}},
      {"long.wav", {"301 s", "at most 300 s"}},
      {"flac.wav", {"ChunkID", "convert"}},
      {"cut.wav", {"truncated", "88200", "39956", "again"}},
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

TEST(WavFile, AnyCutOfAFileIsRefusedOrShort) {
  const test::TempDir temp;
  ASSERT_TRUE(write_wav(temp / "whole.wav", tone(440, 0.5, 8000, 22050), 22050));
  const std::string whole = test::content(temp / "whole.wav");
  for (std::size_t bytes = 0; bytes < whole.size(); bytes += bytes < 60 ? 1 : 997) {
    put(temp / "cut.wav", whole.substr(0, bytes));
    EXPECT_FALSE(read_wav(temp / "cut.wav")) << bytes;
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
    const auto read = read_wav(temp / "changed.wav", Channel::mean);
    if (!read) {
      EXPECT_EQ(std::ranges::count(read.error().message, '\n'), 0) << read.error().message;
      continue;
    }
    EXPECT_LE(read->samples.size(), 8000U);
    for (const float x : read->samples) ASSERT_LE(std::abs(x), 1.0F);
  }
}

TEST(WavFile, RealRecordingsAreRead) {
  const auto shared = test::find_shared();
  if (!shared) GTEST_SKIP() << "SKIPPED: no recordings: the folder shared/ is not beside the checkout";
  const auto drill = read_wav(*shared / "data/sound/chai3d_drill.wav", Channel::left);
  ASSERT_TRUE(drill) << drill.error().message;
  EXPECT_EQ(drill->rate_hz, 48000);
  EXPECT_NEAR(drill->seconds(), 3.44, 0.01);
  const auto saw = read_wav(*shared / "data/sound/opensfx_40_circular_saw.wav");
  ASSERT_TRUE(saw) << saw.error().message;
  EXPECT_NEAR(saw->seconds(), 3.90, 0.01);
}

TEST(Resample, AToneStaysAsItIsAndDoesNotMove) {
  for (const double from_hz : {44100.0, 48000.0}) {
    const std::vector<float> result = resampled(tone(3000, 0.5, 48000, from_hz), from_hz, 22050);
    EXPECT_EQ(result.size(), static_cast<std::size_t>(std::llround(48000 * 22050 / from_hz)));
    const std::vector<float> expected = tone(3000, 0.5, result.size(), 22050);
    for (std::size_t i = 500; i + 500 < result.size(); ++i) ASSERT_NEAR(result[i], expected[i], 1e-4) << i;
  }
}

TEST(Resample, WhatTheNewRateCannotHaveIsGone) {
  const std::vector<float> result = resampled(tone(13000, 0.5, 48000, 48000), 48000, 22050);
  EXPECT_LT(rms_db(std::span(result).subspan(500, result.size() - 1000)), -100);
}

TEST(Resample, SameRateSameSamples) {
  const std::vector<float> noise = white_noise(0.1, 1000, 1);
  EXPECT_EQ(resampled(noise, 22050, 22050), noise);
  EXPECT_TRUE(resampled({}, 44100, 22050).empty());
}

}  // namespace
}  // namespace osteon::sound
