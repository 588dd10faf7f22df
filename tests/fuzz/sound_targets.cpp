#include "tests/fuzz/sound_targets.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "audio_client/offline/state_record.hpp"
#include "audio_client/presets/preset_file.hpp"
#include "audio_client/synth/handpiece.hpp"
#include "audio_client/synth/voice.hpp"
#include "common/core/check.hpp"
#include "common/core/digest.hpp"
#include "common/sound/random.hpp"
#include "common/sound/spectral_model_bytes.hpp"
#include "common/sound/wav_file.hpp"
#include "common/sound/wav_writer.hpp"
#include "tests/fuzz/import_files.hpp"

namespace osteon::fuzz {
namespace {

// A short drilling: two lines, noise, and a knock.
std::vector<float> a_sound(std::size_t samples) {
  sound::Random random(1);
  std::vector<float> made(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    const double t = static_cast<double>(i);
    made[i] = static_cast<float>(0.2 * std::sin(0.3 * t) + 0.1 * std::sin(0.71 * t) + 0.02 * (random.unit() - 0.5) +
                                 (i > samples / 2 ? 0.5 * std::exp(-0.01 * (t - samples / 2.0)) : 0.0));
  }
  return made;
}

void read_any_wav(std::span<const std::uint8_t> data) {
  static const InputFile file("sound.wav");
  const auto& path = file.write(data);
  for (const auto channel : {std::optional<sound::Channel>(), std::optional(sound::Channel::mean)}) {
    const auto sound = sound::read_wav(path, {.channel = channel});
    if (!sound) {
      expect_bounded(sound.error());
      continue;
    }
    OSTEON_CHECK(sound->rate_hz >= sound::kLowestRate_hz && sound->rate_hz <= sound::kHighestRate_hz);
    OSTEON_CHECK(sound->seconds() <= sound::kLongest_s + 1.0);
    OSTEON_CHECK(std::ranges::all_of(sound->samples, [](float x) { return std::isfinite(x); }));
  }
}

Bytes a_wav(int rate_hz, int channels, int bits) {
  const InputFile file("seed.wav");
  const auto mono = a_sound(static_cast<std::size_t>(rate_hz / 4 + 16));
  std::vector<float> samples;
  for (const float x : mono)
    for (int c = 0; c < channels; ++c) samples.push_back(x);
  const auto path = file.folder() / "made.wav";
  auto writer = sound::WavWriter::open(path, {.rate_hz = rate_hz, .channels = channels, .bits = bits});
  OSTEON_CHECK(writer && writer->write(samples) && writer->close());
  return bytes_of_file(path);
}

constexpr std::size_t kDigestBytes = 32;

void read_any_model(std::span<const std::uint8_t> data) {
  const std::string bytes(data.begin(), data.end());
  const auto model = sound::model_from_bytes(bytes, "sound.model");
  if (!model) return expect_bounded(model.error());
  // A sound of minutes would take seconds for each input.
  if (model->samples <= 48000) OSTEON_CHECK(sound::resynthesised(*model, 1).size() == model->samples);
  OSTEON_CHECK(sound::model_from_bytes(sound::bytes_of(*model), "again.model").has_value());
}

// Without its digest no changed model would pass the first check.
void sign(Bytes& model) {
  if (model.size() < kDigestBytes) return;
  const std::size_t size = model.size() - kDigestBytes;
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(model).first(size)));
  const Digest digest = hasher.finish();
  std::ranges::copy(digest.bytes, model.begin() + static_cast<std::ptrdiff_t>(size));
}

void change_model(Bytes& input, std::mt19937& random) {
  if (input.size() <= kDigestBytes) return;
  // The header decides most, so it is changed most often.
  const std::size_t body = input.size() - kDigestBytes, size = random() % 2 ? body : std::min<std::size_t>(body, 64);
  input[random() % size] = static_cast<std::uint8_t>(random() % 4 ? random() : 0xFF);
  if (random() % 8 == 0) input.erase(input.begin() + static_cast<std::ptrdiff_t>(random() % body));
  sign(input);
}

Bytes a_model() {
  const std::vector<float> sound = a_sound(8000);
  return bytes_of_text(sound::bytes_of(sound::spectral_analysis(sound, 22050).model));
}

void read_any_log(std::span<const std::uint8_t> data) {
  static const InputFile file("session.csv");
  const auto record = audio::open_states(file.write(data));
  if (!record) return expect_bounded(record.error());
  for (;;) {
    const auto state = (*record)->next();
    if (!state) return expect_bounded(state.error());
    if (!*state) return;
    OSTEON_CHECK(std::isfinite((*state)->spindle_rpm) && (*state)->force_physical_N.allFinite());
    OSTEON_CHECK((*record)->done() >= 0 && (*record)->done() <= 1);
  }
}

// What is read can be played: a tool that runs up in bone, and is struck.
void play_any_preset(std::span<const std::uint8_t> data) {
  const auto model = audio::parse_preset({reinterpret_cast<const char*>(data.data()), data.size()}, "preset.yaml");
  if (!model) return expect_bounded(model.error());
  const audio::Handpiece piece = audio::make_handpiece(*model, nullptr, 48000);
  audio::ToolSound tool;
  tool.rpm = 1000;
  tool.load = tool.hardness = tool.chips = 1;
  tool.torque_Nmm = 20;
  tool.cortex_mm = 2;
  audio::Voice voice;
  voice.start(piece, {}, 48000, tool, 1);
  tool.blows = 1;
  tool.blow_impulse_N_s = 3;
  for (int i = 0; i < 8; ++i) {
    voice.aim(tool);
    audio::Block block{};
    voice.add_to(block);
    OSTEON_CHECK(std::ranges::all_of(block, [](float x) { return std::isfinite(x); }));
  }
}

}  // namespace

Target wav_file_target() {
  Target target{"wav_file", read_any_wav, {a_wav(22050, 1, 16), a_wav(22050, 2, 24)}};
  target.mutations = 300;
  return target;
}

Target sound_model_target() {
  Target target{"sound_model", read_any_model, {a_model()}};
  target.mutations = 500;
  target.change = change_model;
  return target;
}

Target session_log_target() {
  Target target{"session_log",
                read_any_log,
                {bytes_of_text("time_s,mono_ns,state_seq,phase,tool,tip_x_mm,tip_y_mm,tip_z_mm,force_physical_n,"
                               "feed_mm_per_s,density_g_cm3,rpm,torque_nmm,author,suction\n"
                               "0.000,5000000,1,free,drill-3.2,1,2,3,0,0,0,1000,0,1,0\n"
                               "0.001,6000000,2,cutting,drill-3.2,1,2,3.01,27.5,0.9,1.9,980.5,25.25,1,1\n")}};
  target.mutations = 500;
  target.change = change_number;
  return target;
}

Target preset_target() {
  std::vector<Bytes> seeds;
  for (audio::ToolModel model : audio::builtin_presets()) {
    if (model.drive == audio::Drive::blows) {
      model.recorded_s = 2;
      model.transients.assign(1, std::vector<float>(441, 0.25F));
    }
    seeds.push_back(bytes_of_text(audio::to_yaml(model)));
  }
  Target target{"sound_preset", play_any_preset, std::move(seeds)};
  target.mutations = 100;
  target.change = change_number;
  return target;
}

}  // namespace osteon::fuzz
