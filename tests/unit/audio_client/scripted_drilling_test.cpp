// Fifteen seconds of drilling through both cortices: the layers can be distinguished by the sound. With
// OSTEON_SOUND_DIR set, the recording is saved there for listening.
#include <gtest/gtest.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "audio_client/output/wav_recorder.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/spectrum.hpp"
#include "common/sound/tones.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::audio {
namespace {

std::vector<float> read_left(const std::filesystem::path& file, double& rate_hz) {
  SF_INFO info{};
  SNDFILE* in = sf_open(file.c_str(), SFM_READ, &info);
  if (!in) return {};
  std::vector<float> all(static_cast<std::size_t>(info.frames * info.channels)), left;
  sf_readf_float(in, all.data(), info.frames);
  sf_close(in);
  for (std::size_t i = 0; i < all.size(); i += static_cast<std::size_t>(info.channels)) left.push_back(all[i]);
  rate_hz = info.samplerate;
  return left;
}

TEST(ScriptedDrilling, TheEarTellsTheLayersApart) {
  const test::ScriptedDrilling script = test::scripted_drilling();
  DrillSynth synth;
  synth.prepare({});
  const std::vector<float> samples = test::play(synth, script.states);
  EXPECT_NEAR(static_cast<double>(samples.size()) / test::kRate_hz, 15.0, 0.1);

  const test::TempDir temp;
  const char* keep = std::getenv("OSTEON_SOUND_DIR");
  const std::filesystem::path file = (keep ? std::filesystem::path(keep) : temp.path()) / "scripted-drilling.wav";
  auto recorder = WavRecorder::open(file, 48000, 1, Existing::replaced);
  ASSERT_TRUE(recorder) << recorder.error().message;
  const auto push = [&](std::span<const float> part) { recorder->push(part, part); };
  push(std::span(samples).first(200000));
  while (recorder->frames_written() < 200000) std::this_thread::yield();
  for (std::size_t at = 200000; at < samples.size(); at += 100000) {
    const std::size_t count = std::min<std::size_t>(100000, samples.size() - at);
    push(std::span(samples).subspan(at, count));
    while (recorder->frames_written() < at + count) std::this_thread::yield();
  }
  ASSERT_TRUE(recorder->close());
  EXPECT_EQ(recorder->frames_lost(), 0U);

  // The file equals what was played, to half a step of 16 bits and its rounding.
  double rate_hz = 0;
  const std::vector<float> heard = read_left(file, rate_hz);
  ASSERT_EQ(heard.size(), samples.size());
  for (std::size_t i = 0; i < heard.size(); i += 97) ASSERT_NEAR(heard[i], samples[i], 1.1 / 32768);

  std::map<std::string, double> level_db, bright_hz;
  for (const test::ScriptedPart& part : script.parts) {
    // After the knock and the run-down of the part before.
    const double from_s = part.from_s + (part.to_s - part.from_s > 1 ? 0.6 : 0.0);
    const auto from = static_cast<std::size_t>(from_s * rate_hz), to = static_cast<std::size_t>(part.to_s * rate_hz);
    const std::span<const float> piece = std::span(heard).subspan(from, to - from);
    level_db[part.name] = sound::rms_db(piece);
    bright_hz[part.name] = sound::centroid_hz(sound::power_spectrum(piece, rate_hz), 20, 20000);
    RecordProperty(std::string(part.name) + " dB", std::to_string(level_db[part.name]));
    if (keep) std::printf("%-14s %7.1f dB  centroid %6.0f Hz\n", part.name, level_db[part.name], bright_hz[part.name]);
  }
  EXPECT_EQ(level_db["off"], sound::kSilence_db);
  EXPECT_EQ(level_db["off again"], sound::kSilence_db);
  EXPECT_GT(level_db["cancellous"], level_db["free"] + 3);
  EXPECT_GT(level_db["cortical"], level_db["cancellous"] + 4);
  EXPECT_NEAR(level_db["far cortical"], level_db["cortical"], 1);
  EXPECT_NEAR(level_db["free again"], level_db["free"], 1);
  EXPECT_GT(bright_hz["cortical"], bright_hz["cancellous"] + 200);

  // 8.5.4: perforation is a short burst with energy round 200 Hz. Then the sound drops to free running.
  const test::ScriptedPart& far_part = script.parts[4];
  const test::ScriptedPart& burst = script.parts[5];
  const auto low_db = [&](double from_s, double seconds) {
    const auto from = static_cast<std::size_t>(from_s * rate_hz), count = static_cast<std::size_t>(seconds * rate_hz);
    return sound::band_db(sound::power_spectrum(std::span(heard).subspan(from, count), rate_hz, 2048), 100, 300);
  };
  EXPECT_GT(low_db(burst.from_s - 0.02, 0.06), low_db(far_part.to_s - 0.5, 0.06) + 6);
  EXPECT_LT(level_db["free again"], level_db["far cortical"] - 7);
}

TEST(ScriptedDrilling, LinesStandWhereARealGearedDrillHasThem) {
  const auto shared = test::find_shared();
  if (!shared) GTEST_SKIP() << "SKIPPED: no recordings: the folder shared/ is not beside the checkout";
  double rate_hz = 0;
  const std::vector<float> real = read_left(*shared / "data/sound/chai3d_drill.wav", rate_hz);
  ASSERT_FALSE(real.empty());
  const std::vector<sound::Peak> real_lines =
      sound::strongest_peaks(sound::power_spectrum(real, rate_hz, 8192), 12, 60);
  // Its strongest line is twice the output mesh. The mesh's frequency gives the spindle's speed: about 1425 rpm.
  const double twice_hz = real_lines.front().hz;
  const double rpm = 60.0 * twice_hz / (2 * 48);
  EXPECT_NEAR(rpm, 1425, 15);

  DrillSynth synth;
  synth.prepare({});
  static_cast<void>(test::play(synth, test::free_drill(rpm), 0.75));
  const std::vector<float> made = test::play(synth, test::free_drill(rpm), 2.0);
  const sound::Spectrum spectrum = sound::power_spectrum(made, test::kRate_hz, 8192);
  // The real drill's 2:3:6 lines are harmonics of the output mesh. In our sound they stand out by 6 dB or more.
  for (const int harmonic : {2, 3, 6}) {
    const double hz = harmonic * twice_hz / 2;
    const double line = sound::band_db(spectrum, hz - 20, hz + 20), beside = sound::band_db(spectrum, hz + 30, hz + 70);
    EXPECT_GT(line, beside + 6) << harmonic;
    // The hand's unsteady speed smears the real lines a little: 0.3 %.
    EXPECT_TRUE(std::any_of(real_lines.begin(), real_lines.end(), [&](const sound::Peak& heard) {
      return std::abs(heard.hz - hz) < 0.003 * hz;
    })) << harmonic;
  }
  // Both have most of their power between 400 Hz and 12 kHz.
  const auto middle_share_db = [](const sound::Spectrum& s) {
    return sound::band_db(s, 400, 12000) - sound::band_db(s, 0, 24001);
  };
  EXPECT_GT(middle_share_db(spectrum), -0.5);
  EXPECT_GT(middle_share_db(sound::power_spectrum(real, rate_hz, 8192)), -1.0);
}

}  // namespace
}  // namespace osteon::audio
