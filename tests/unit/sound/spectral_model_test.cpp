// Spectral models: the parts sum to the sound, the sound of the model resembles it, and damaged files are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <vector>

#include "common/core/digest.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/likeness.hpp"
#include "common/sound/resample.hpp"
#include "common/sound/spectral_model.hpp"
#include "common/sound/spectral_model_bytes.hpp"
#include "common/sound/wav_file.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::sound {
namespace {

// A second of two lines in noise, and a blow.
std::vector<float> workshop() {
  std::vector<float> samples = added(tone(1140, 0.1, 22050, kAnalysed_hz), tone(2280, 0.05, 22050, kAnalysed_hz));
  samples = added(samples, white_noise(0.01, 22050, 2));
  const std::vector<float> blow = white_noise(0.5, 1000, 3);
  for (std::size_t i = 0; i < blow.size(); ++i)
    samples[12000 + i] += blow[i] * static_cast<float>(std::exp(-static_cast<double>(i) / 100.0));
  return samples;
}

const SpectralAnalysis& analysed_workshop() {
  static const SpectralAnalysis analysis = spectral_analysis(workshop(), kAnalysed_hz);
  return analysis;
}

TEST(SpectralModel, SinesAndResidualAreTheSound) {
  const std::vector<float> samples = workshop();
  const SpectralAnalysis& a = analysed_workshop();
  ASSERT_EQ(a.residual.size(), samples.size());
  // Only the last bit of the subtraction is rounded.
  for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_NEAR(a.sines[i] + a.residual[i], samples[i], 1.2e-7F) << i;
  EXPECT_GT(rms_db(a.sines), rms_db(a.residual));
}

TEST(SpectralModel, ABlowIsKeptAsSamples) {
  const SpectralModel& model = analysed_workshop().model;
  ASSERT_EQ(model.transients.size(), 1U);
  EXPECT_NEAR(static_cast<double>(model.transients[0].begin), 12000 - 22, 12);
  const std::vector<float> samples = workshop(), sound = resynthesised(model, 1);
  for (std::size_t i = 12010; i < 12300; ++i) ASSERT_NEAR(sound[i], samples[i], 1e-6) << i;
}

TEST(SpectralModel, TheSoundOfTheModelHasTheLevelsOfTheSound) {
  const std::vector<float> samples = workshop(), sound = resynthesised(analysed_workshop().model, 1);
  EXPECT_LT(psd_lsd_db(samples, sound, kAnalysed_hz), 3.0);
  EXPECT_LT(mel_lsd_db(samples, sound, kAnalysed_hz), 3.0);
  EXPECT_LT(envelope_error_db(samples, sound, kAnalysed_hz), 0.5);
}

TEST(SpectralModel, TonesAreRecoveredFromTheFile) {
  const std::vector<float> samples =
      added(tone(2280.3, 0.2, 44100, kAnalysed_hz), tone(3419.6, 0.05, 44100, kAnalysed_hz));
  const auto model = model_from_bytes(bytes_of(spectral_analysis(samples, kAnalysed_hz).model), "tones");
  ASSERT_TRUE(model) << model.error().message;
  for (const auto& [hz, amplitude] : {std::pair{2280.3, 0.2}, std::pair{3419.6, 0.05}}) {
    const auto found = std::ranges::find_if(
        model->partials, [&](const std::vector<Knot>& knots) { return std::abs(knots.front().hz - hz) < 0.5; });
    ASSERT_NE(found, model->partials.end()) << hz;
    EXPECT_EQ(found->back().frame, 44100U / 128);
    for (const Knot& knot : *found) {
      EXPECT_NEAR(knot.hz, hz, 0.5);
      EXPECT_NEAR(knot.level_db, 20.0 * std::log10(amplitude), 0.2);
    }
  }
}

TEST(SpectralModel, ToneAndNoiseGoToTheirParts) {
  const std::vector<float> noise = white_noise(0.01, 44100, 2), line = tone(1140, 0.1, 44100, kAnalysed_hz);
  SpectralParams params;
  params.partials.peaks.threshold_db = -45;  // above the noise
  const SpectralAnalysis a = spectral_analysis(added(line, noise), kAnalysed_hz, params);
  EXPECT_GT(snr_db(line, a.sines), 25.0);
  EXPECT_NEAR(rms_db(a.residual), -40.0, 0.5);
}

TEST(SpectralModel, TheSeedDecides) {
  const SpectralModel& model = analysed_workshop().model;
  EXPECT_EQ(resynthesised(model, 5), resynthesised(model, 5));
  EXPECT_NE(resynthesised(model, 5), resynthesised(model, 6));
  const SpectralAnalysis again = spectral_analysis(workshop(), kAnalysed_hz);
  EXPECT_EQ(bytes_of(again.model), bytes_of(model));
}

TEST(SpectralModel, ShortAndSilentSoundsHaveModels) {
  for (const std::size_t count : {0U, 1U, 40U, 700U}) {
    const std::vector<float> noise = white_noise(0.1, count, 2);
    EXPECT_EQ(resynthesised(spectral_analysis(noise, kAnalysed_hz).model, 1).size(), count);
  }
  const SpectralAnalysis silent = spectral_analysis(std::vector<float>(5000, 0.0F), kAnalysed_hz);
  EXPECT_TRUE(silent.model.partials.empty());
  EXPECT_LT(rms_db(resynthesised(silent.model, 1)), -150);
}

struct Required {
  const char* file;
  int rate_hz;
  double seconds, snr_db, psd_lsd_db, mel_lsd_db, envelope_error_db;
};

// Our own workshop, and the recordings beside the checkout with what their README requires of a model. The workshop's
// noise and blow lie 10.1 dB below its sound, so its lines alone have about this SNR.
std::vector<Required> required() {
  std::vector<Required> all{{"workshop.wav", 22050, 1.0, 9.0, 3.0, 3.0, 0.5}};
  if (test::find_shared())
    all.insert(all.end(), {{"chai3d_drill.wav", 48000, 3.44, 7.5, 1.8, 2.1, 0.65},
                           {"opensfx_40_circular_saw.wav", 44100, 3.90, 6.0, 3.4, 2.4, 0.9},
                           {"opensfx_39_smithy_hammer.wav", 44100, 2.42, 7.6, 3.4, 2.5, 1.0}});
  else
    std::cerr << "SKIPPED: recordings of tools: the folder shared/ is not beside the checkout\n";
  return all;
}

class Recordings : public testing::TestWithParam<Required> {};

TEST_P(Recordings, AreResembledAsRequired) {
  const test::TempDir temp;
  ASSERT_TRUE(write_wav(temp / "workshop.wav", workshop(), 22050));
  const std::filesystem::path own = temp / GetParam().file;
  const auto recording =
      read_wav(std::filesystem::exists(own) ? own : *test::find_shared() / "data/sound" / GetParam().file,
               {.channel = Channel::left});
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->rate_hz, GetParam().rate_hz);
  EXPECT_NEAR(recording->seconds(), GetParam().seconds, 0.01);
  const std::vector<float> samples = resampled(recording->samples, recording->rate_hz, kAnalysed_hz);
  for (const int refinements : {0, 2}) {
    SpectralParams params;
    params.partials.peaks.refinements = refinements;
    const SpectralAnalysis a = spectral_analysis(samples, kAnalysed_hz, params);
    const auto model = model_from_bytes(bytes_of(a.model), "it");
    ASSERT_TRUE(model) << model.error().message;
    EXPECT_GE(snr_db(samples, a.sines), GetParam().snr_db);
    const std::vector<float> sound = resynthesised(*model, 1);
    EXPECT_LE(psd_lsd_db(samples, sound, kAnalysed_hz), GetParam().psd_lsd_db);
    EXPECT_LE(mel_lsd_db(samples, sound, kAnalysed_hz), GetParam().mel_lsd_db);
    EXPECT_LE(envelope_error_db(samples, sound, kAnalysed_hz), GetParam().envelope_error_db);
  }
}
INSTANTIATE_TEST_SUITE_P(OwnAndReal, Recordings, testing::ValuesIn(required()));

TEST(SpectralModelBytes, AModelReadIsTheModelWritten) {
  const SpectralModel& written = analysed_workshop().model;
  const auto read = model_from_bytes(bytes_of(written), "a.model");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->rate_hz, written.rate_hz);
  EXPECT_EQ(read->samples, written.samples);
  EXPECT_EQ(read->hop, written.hop);
  ASSERT_EQ(read->partials.size(), written.partials.size());
  for (std::size_t p = 0; p < written.partials.size(); ++p) {
    ASSERT_EQ(read->partials[p].size(), written.partials[p].size());
    for (std::size_t i = 0; i < written.partials[p].size(); ++i) {
      const Knot& a = read->partials[p][i];
      const Knot& b = written.partials[p][i];
      EXPECT_EQ(a.frame, b.frame);
      EXPECT_NEAR(a.hz, b.hz, 0.09);
      EXPECT_NEAR(a.level_db, std::clamp(b.level_db, -79.0, 6.0), 0.167);
    }
  }
  ASSERT_EQ(read->noise.size(), written.noise.size());
  for (std::size_t l = 0; l < written.noise.size(); ++l) {
    EXPECT_EQ(read->noise[l].points_hz, written.noise[l].points_hz);
    EXPECT_EQ(read->noise[l].frames, written.noise[l].frames);
    ASSERT_EQ(read->noise[l].levels_db.size(), written.noise[l].levels_db.size());
    for (std::size_t i = 0; i < written.noise[l].levels_db.size(); ++i)
      EXPECT_NEAR(read->noise[l].levels_db[i], written.noise[l].levels_db[i], 0.334);
  }
  ASSERT_EQ(read->transients.size(), 1U);
  EXPECT_EQ(read->transients[0].begin, written.transients[0].begin);
  for (std::size_t i = 0; i < read->transients[0].samples.size(); ++i)
    EXPECT_NEAR(read->transients[0].samples[i], std::clamp(written.transients[0].samples[i], -1.0F, 1.0F), 2e-5);
  // What was rounded once stays.
  EXPECT_EQ(bytes_of(*read), bytes_of(written));
}

TEST(SpectralModelBytes, ALongLineIsDivided) {
  SpectralModel model = analysed_workshop().model;
  model.samples = 1000 * 128;
  model.partials = {{{.frame = 3, .hz = 1000, .level_db = -20}, {.frame = 903, .hz = 1900, .level_db = -50}}};
  model.noise.clear();
  const auto read = model_from_bytes(bytes_of(model), "long");
  ASSERT_TRUE(read) << read.error().message;
  const Partial partial = partial_of(read->partials[0]);
  ASSERT_EQ(partial.points.size(), 901U);
  for (std::size_t i = 0; i < partial.points.size(); ++i)
    EXPECT_NEAR(partial.points[i].hz, 1000.0 + static_cast<double>(i), 0.1);
}

// The bytes with a right digest, so that only the fields can be wrong.
std::string sealed(std::string bytes) {
  bytes.resize(bytes.size() - 32);
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(bytes)));
  const Digest digest = hasher.finish();
  return bytes.append(reinterpret_cast<const char*>(digest.bytes.data()), digest.bytes.size());
}

TEST(SpectralModelBytes, DamageIsRefusedByASentence) {
  const std::string whole = bytes_of(analysed_workshop().model);
  const auto with = [&](std::size_t at, unsigned char value) {
    std::string changed = whole;
    changed[at] = static_cast<char>(value);
    return sealed(changed);
  };
  struct Wrong {
    std::string bytes;
    std::string says;
  };
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 1);
  const std::vector<Wrong> cases = {
      {"", "no spectral model"},
      {"RIFF....WAVE", "no spectral model"},
      {with(8, 2), "version is 2"},
      {whole.substr(0, 9), "too early"},
      {whole.substr(0, 30), "too early"},
      {whole.substr(0, whole.size() - 1), "SHA-256"},
      {flipped, "SHA-256"},
      {with(12, 0xff), "its rate is"},
      {with(17, 0xff), "number of samples"},
      {with(18, 0), "its hop is 0"},
      {with(25, 0xff), "frame of knot 0 of partial 0"},
      {with(27, 0xff), "number of knots of partial 0"},
      {sealed(whole + "more"), "bytes follow its end"},
  };
  for (const Wrong& wrong : cases) {
    const auto read = model_from_bytes(wrong.bytes, "drill.model");
    ASSERT_FALSE(read) << wrong.says;
    EXPECT_THAT(read.error().message, testing::StartsWith("drill.model"));
    EXPECT_THAT(read.error().message, testing::HasSubstr(wrong.says));
    EXPECT_EQ(std::ranges::count(read.error().message, '\n'), 0);
  }
}

TEST(SpectralModelBytes, AnyCutIsRefused) {
  const std::string whole = bytes_of(analysed_workshop().model);
  for (std::size_t size = 0; size < whole.size(); size += size < 100 ? 1 : 211) {
    EXPECT_FALSE(model_from_bytes(whole.substr(0, size), "cut")) << size;
    if (size >= 42) {
      EXPECT_FALSE(model_from_bytes(sealed(whole.substr(0, size)), "cut")) << size;
    }
  }
}

TEST(SpectralModelBytes, ChangedBytesAreRefusedOrHarmless) {
  // A short sound, because each model that is accepted is played.
  const std::vector<float> samples = workshop();
  const std::string whole = bytes_of(spectral_analysis(std::span(samples).subspan(11000, 3000), kAnalysed_hz).model);
  std::mt19937 random(1);
  int accepted = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string changed = whole;
    const std::size_t reach = i % 2 == 0 ? 64 : changed.size() - 32;
    for (int k = 0; k < 3; ++k) changed[8 + random() % (reach - 8)] = static_cast<char>(random());
    const auto read = model_from_bytes(sealed(changed), "changed");
    if (!read) {
      EXPECT_EQ(std::ranges::count(read.error().message, '\n'), 0);
      continue;
    }
    ++accepted;
    if (accepted % 50 != 0) continue;
    for (const float x : resynthesised(*read, 1)) ASSERT_TRUE(std::isfinite(x));
  }
  EXPECT_GT(accepted, 100);
}

}  // namespace
}  // namespace osteon::sound
