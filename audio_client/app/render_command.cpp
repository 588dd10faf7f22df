#include "audio_client/app/render_command.hpp"

#include <CLI/CLI.hpp>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "audio_client/app/output_file.hpp"
#include "audio_client/app/preset_command.hpp"
#include "audio_client/offline/offline_sound.hpp"
#include "audio_client/offline/state_record.hpp"
#include "common/runtime/progress.hpp"
#include "common/runtime/stop_signal.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/wav_writer.hpp"

namespace osteon::audio {
namespace {

struct RenderArguments {
  std::string record, out;
  int rate_hz = 48000, bits = 16;
  std::uint64_t seed = 1;
  std::vector<std::string> presets;
};

std::string summary(const RenderArguments& a, const OfflineSound& sound, double work_s) {
  const double seconds = static_cast<double>(sound.frames) / a.rate_hz;
  const double peak_db = sound.peak > 0 ? 20.0 * std::log10(static_cast<double>(sound.peak)) : sound::kSilence_db;
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(),
                "states     %llu in %.3f s of sound, %d Hz, peak %.1f dB\n"
                "made       in %.3f s, %.0f times as fast as it sounds\n",
                static_cast<unsigned long long>(sound.states), seconds, a.rate_hz, peak_db, work_s, seconds / work_s);
  return text.data() + ("written    " + a.out + "\n");
}

Result<std::string> run_render(const RenderArguments& a) {
  std::vector<OtherFile> read{{a.record}};
  for (const std::string& preset : a.presets) read.push_back({preset});
  if (auto usable = check_output(a.out, "the sound", "--out", read); !usable) return tl::unexpected(usable.error());
  auto presets = presets_of(a.presets);
  if (!presets) return tl::unexpected(presets.error());
  auto record = open_states(a.record);
  if (!record) return tl::unexpected(record.error());
  auto writer = sound::WavWriter::open(a.out, {.rate_hz = a.rate_hz, .channels = 1, .bits = a.bits});
  if (!writer) return tl::unexpected(writer.error());

  const StopSignal stop;
  std::optional<Progress> bar;  // appears with the first work, so that a refused record prints only its sentence
  const auto keep_going = [&](double done) {
    if (done > 0 && !bar) bar.emplace("making the sound");
    if (bar) bar->update(done);
    return !stop.requested();
  };
  SynthParams params;
  params.rate_hz = a.rate_hz;
  params.seed = a.seed;
  params.presets = std::move(*presets);
  const auto begin = std::chrono::steady_clock::now();
  const auto sound = render_states(
      **record, params, [&](std::span<const float> frames) { return writer->write(frames); }, keep_going);
  bar.reset();
  if (!sound && sound.error().code == ErrorCode::cancelled)
    return failure(ErrorCode::cancelled, "stopped; " + a.out + " was not written");
  if (!sound) return tl::unexpected(sound.error());
  if (auto closed = writer->close(); !closed) return tl::unexpected(closed.error());
  const std::chrono::duration<double> work = std::chrono::steady_clock::now() - begin;
  return summary(a, *sound, work.count());
}

}  // namespace

void add_render_command(CLI::App& app, std::function<Result<std::string>()>& chosen) {
  const auto shared = std::make_shared<RenderArguments>();
  RenderArguments& a = *shared;
  CLI::App* command =
      app.add_subcommand("render", "Make the sound of a recorded session, without a server and faster than it sounds");
  command->add_option("RECORD", a.record, "What osteon-haptic --record (session.h5) or --session-log (CSV) wrote")
      ->required();
  command->add_option("--out", a.out, "WAV file for the sound, PCM, mono")->required();
  command->add_option("--rate", a.rate_hz, "Samples in a second; the live sound has 48000")
      ->check(CLI::Range(22050, 192000))
      ->capture_default_str();
  command->add_option("--bits", a.bits, "Of a sample: 16 or 24")->check(CLI::IsMember({16, 24}))->capture_default_str();
  command->add_option("--seed", a.seed, "Of the noise: the same gives the same sound; the live one has 1")
      ->capture_default_str();
  command
      ->add_option("--preset", a.presets,
                   "Preset of a tool's sound, or a folder of presets, which go before those of Osteon; may be repeated")
      ->allow_extra_args(false);
  command->callback([shared, &chosen] { chosen = [shared] { return run_render(*shared); }; });
}

}  // namespace osteon::audio
