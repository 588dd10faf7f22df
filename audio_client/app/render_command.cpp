#include "audio_client/app/render_command.hpp"

#include <CLI/CLI.hpp>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "audio_client/app/listening_option.hpp"
#include "audio_client/app/output_file.hpp"
#include "audio_client/app/preset_command.hpp"
#include "audio_client/app/recording_option.hpp"
#include "audio_client/offline/offline_sound.hpp"
#include "audio_client/offline/state_record.hpp"
#include "common/runtime/stop_signal.hpp"
#include "common/runtime/stoppable_progress.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/wav_writer.hpp"

namespace osteon::audio {
namespace {

constexpr int kMostOfHeadphones_hz = 48000;

struct RenderArguments {
  std::string record, out;
  int rate_hz = 48000, bits = 16;
  std::uint64_t seed = 1;
  ListeningOption listening;
  std::vector<std::string> presets;
};

std::string summary(const RenderArguments& a, const OfflineSound& sound, const std::string& note, double work_s) {
  const double seconds = static_cast<double>(sound.frames) / a.rate_hz;
  const double peak_db = sound.peak > 0 ? 20.0 * std::log10(static_cast<double>(sound.peak)) : sound::kSilence_db;
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(),
                "states     %llu in %.3f s of sound, %d Hz, peak %.1f dB\n"
                "listener   %s\n"
                "made       in %.3f s, %.0f times as fast as it sounds\n",
                static_cast<unsigned long long>(sound.states), seconds, a.rate_hz, peak_db, a.listening.listen.c_str(),
                work_s, seconds / work_s);
  return text.data() + (note.empty() ? "" : "note       " + note + "\n") + "written    " + a.out + "\n";
}

int channels_of(const Space& space) { return space.listening == Listening::mono ? 1 : 2; }

// Of the sound that a record of that length becomes.
double bytes_of(const RenderArguments& a, const Space& space, double seconds) {
  return (seconds + kLongestTail_s) * a.rate_hz * channels_of(space) * a.bits / 8;
}

Result<void> check_size(const RenderArguments& a, const Space& space, double seconds) {
  constexpr auto kMost = static_cast<double>(sound::WavWriter::kMostBytes);
  if (bytes_of(a, space, seconds) <= kMost) return {};
  const double longest_s = seconds * kMost / bytes_of(a, space, seconds);
  std::array<char, 256> why{};
  std::snprintf(why.data(), why.size(),
                " lasts %.0f minutes, and its sound would be %.1f GB, but a WAV file holds 4 GB; use %s%sa lower "
                "--rate or a part of the record of at most %.0f minutes",
                seconds / 60, 1e-9 * bytes_of(a, space, seconds), a.bits == 24 ? "--bits 16, " : "",
                channels_of(space) == 2 ? "--listen mono, " : "", std::floor(longest_s / 60));
  return bad_input(a.record + why.data());
}

// The length of the record. Refuses a record whose sound is too large before that is made, and finds what the listener
// looks at: the record does not have the bone's bounds, of which the live listener looks at the middle.
Result<double> read_ahead(const RenderArguments& a, Space& space, const StopSignal& stop) {
  auto states = open_states(a.record);
  if (!states) return tl::unexpected(states.error());
  StoppableProgress progress(stop, "reading the session");
  const auto recorded = survey(**states, [&](double done) { return progress.go_on(done); });
  if (!recorded) return tl::unexpected(recorded.error());
  move_to_middle(space, recorded->middle_mm);
  if (auto fits = check_size(a, space, recorded->seconds); !fits) return tl::unexpected(fits.error());
  return recorded->seconds;
}

Result<SynthParams> synth_params(const RenderArguments& a) {
  SynthParams params;
  params.rate_hz = a.rate_hz;
  params.seed = a.seed;
  auto presets = presets_of(a.presets);
  if (!presets) return tl::unexpected(presets.error());
  params.presets = std::move(*presets);
  // The ears' filters have a fixed number of taps, too few at higher rates.
  if (a.listening.listen == "headphones" && a.rate_hz > kMostOfHeadphones_hz)
    return bad_input("--rate of headphones is at most " + std::to_string(kMostOfHeadphones_hz) +
                     "; give a lower one, or another --listen");
  auto space = read(a.listening, params.rate_hz);
  if (!space) return tl::unexpected(space.error());
  params.space = std::move(*space);
  return params;
}

// Writes one channel in mono, and two otherwise.
Result<OfflineSound> write_sound(StateRecord& record, const SynthParams& params, sound::WavWriter& writer,
                                 const StopSignal& stop, double record_s) {
  const bool mono = params.space.listening == Listening::mono;
  std::vector<float> both;
  const auto take = [&](std::span<const float> left, std::span<const float> right) -> Result<void> {
    if (mono) return writer.write(left);
    both.clear();
    for (std::size_t i = 0; i < left.size(); ++i) both.insert(both.end(), {left[i], right[i]});
    return writer.write(both);
  };
  StoppableProgress progress(stop, "making the sound");
  return render_states(
      record, params, take, [&](double done) { return progress.go_on(done); }, record_s);
}

Result<std::string> run_render(const RenderArguments& a) {
  std::vector<OtherFile> read_files{{a.record}, {a.listening.hrtf}};
  for (const std::string& preset : a.presets) read_files.push_back({preset});
  if (auto usable = check_output(a.out, "the sound", "--out", read_files); !usable)
    return tl::unexpected(usable.error());
  auto params = synth_params(a);
  if (!params) return tl::unexpected(params.error());
  auto record = open_states(a.record);
  if (!record) return tl::unexpected(record.error());
  auto writer =
      sound::WavWriter::open(a.out, {.rate_hz = a.rate_hz, .channels = channels_of(params->space), .bits = a.bits});
  if (!writer) return tl::unexpected(writer.error());

  const StopSignal stop(StopSignal::HangUp::stops);
  const auto begin = std::chrono::steady_clock::now();
  const auto looked = read_ahead(a, params->space, stop);
  const Result<OfflineSound> sound = looked ? write_sound(**record, *params, *writer, stop, *looked)
                                            : Result<OfflineSound>(tl::unexpected(looked.error()));
  if (!sound && sound.error().code == ErrorCode::cancelled)
    return failure(ErrorCode::cancelled, "stopped; " + a.out + " was not written");
  if (!sound) return tl::unexpected(sound.error());
  if (auto closed = writer->close(); !closed) return tl::unexpected(closed.error());
  const std::chrono::duration<double> work = std::chrono::steady_clock::now() - begin;
  return summary(a, *sound, (*record)->unknown_tool(), work.count());
}

}  // namespace

void add_render_command(CLI::App& app, std::function<Result<std::string>()>& chosen) {
  const auto shared = std::make_shared<RenderArguments>();
  RenderArguments& a = *shared;
  CLI::App* command =
      app.add_subcommand("render", "Make the sound of a recorded session, without a server and faster than it sounds");
  command->add_option("RECORD", a.record, "What osteon-haptic --record (session.h5) or --session-log (CSV) wrote")
      ->required();
  command->add_option("--out", a.out, "WAV file for the sound, PCM: both channels, or one with --listen mono")
      ->required()
      ->check(given_name());
  add_listening(*command, a.listening, "the work in bone");
  command->add_option("--rate", a.rate_hz, "Samples in a second; the live sound has 48000")
      ->check(CLI::Range(22050, 192000))
      ->capture_default_str();
  command->add_option("--bits", a.bits, "Of a sample: 16 or 24")->check(CLI::IsMember({16, 24}))->capture_default_str();
  command->add_option("--seed", a.seed, "Of the noise: the same gives the same sound; the live one has 1")
      ->check(whole_number())
      ->capture_default_str();
  command
      ->add_option("--preset", a.presets,
                   "Preset of a tool's sound, or a folder of presets, which go before those of Osteon; may be repeated")
      ->allow_extra_args(false);
  command->callback([shared, &chosen] { chosen = [shared] { return run_render(*shared); }; });
}

}  // namespace osteon::audio
