#include "audio_client/app/record_command.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>

#include "audio_client/app/output_file.hpp"
#include "audio_client/app/recording_option.hpp"
#include "audio_client/capture/level_meter.hpp"
#include "audio_client/capture/sound_input.hpp"
#include "common/runtime/number_option.hpp"
#include "common/runtime/stop_signal.hpp"
#include "common/sound/wav_writer.hpp"

namespace osteon::audio {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kTakeEvery = 20ms;
constexpr auto kHeaderEvery = 1s;  // so that the unfinished file of a killed program is readable
constexpr auto kFirstSound = 5s;   // a source that has sent nothing until then will not
constexpr double kLongest_s = 4 * 3600.0;

struct RecordArguments {
  std::string out;
  InputParams input;
  int rate_hz = 48000, channels = 1, bits = 24;
  std::optional<double> seconds;
  bool overwrite = false;
};

// Moves what has come from the input to the file, and no more than the asked length.
class Recording {
 public:
  Recording(const RecordArguments& a, SoundInput& input, sound::WavWriter& writer)
      : input_(input),
        writer_(writer),
        meter_(a.rate_hz, static_cast<unsigned>(a.channels)),
        channels_(static_cast<std::size_t>(a.channels)),
        left_(a.seconds ? static_cast<std::uint64_t>(std::llround(*a.seconds * a.rate_hz))
                        : std::numeric_limits<std::uint64_t>::max()) {}

  Result<void> take_all() {
    InputPiece piece;
    while (left_ > 0 && input_.take(piece)) {
      const std::size_t frames = static_cast<std::size_t>(std::min<std::uint64_t>(left_, piece.count / channels_));
      const std::span<const float> samples = piece.used().first(frames * channels_);
      if (auto written = writer_.write(samples); !written) return written;
      meter_.add(samples);
      left_ -= frames;
    }
    if (Clock::now() - header_at_ < kHeaderEvery) return {};
    header_at_ = Clock::now();
    writer_.update_header();
    return {};
  }

  [[nodiscard]] bool whole() const { return left_ == 0; }
  [[nodiscard]] const LevelMeter& meter() const { return meter_; }

 private:
  SoundInput& input_;
  sound::WavWriter& writer_;
  LevelMeter meter_;
  std::size_t channels_;
  std::uint64_t left_;  // frames
  Clock::time_point header_at_ = Clock::now();
};

std::string report(const RecordArguments& a, const SoundInput& input, const LevelMeter& meter) {
  std::array<char, 160> text{};
  const double peak = meter.peak();
  std::snprintf(text.data(), text.size(), "recorded   %.3f s, %d Hz, %d bits, %d channel%s, peak %.1f dB\n",
                meter.seconds(), a.rate_hz, a.bits, a.channels, a.channels > 1 ? "s" : "",
                peak > 0 ? 20.0 * std::log10(peak) : -200.0);
  std::string all = "source     " + input.device() + "\n" + text.data();
  if (peak == 0) all += "note       only silence came: is the source muted?\n";
  if (meter.clipped() > 0)
    all += "note       " + std::to_string(meter.clipped()) +
           " samples are at full scale, so the sound is clipped; lower the source's level\n";
  if (input.frames_lost() > 0)
    all += "note       " + std::to_string(input.frames_lost()) + " frames are lost: the disk was too slow\n";
  return all + "written    " + a.out + "\n";
}

Result<void> record_until_stopped(Recording& recording, const SoundInput& input, const StopSignal& stop) {
  const auto begin = Clock::now();
  while (!recording.whole() && !stop.wait_for(kTakeEvery)) {
    if (auto taken = recording.take_all(); !taken) return taken;
    if (const std::string why = input.failure_reason(); !why.empty()) return failure(ErrorCode::unavailable, why);
    if (recording.meter().seconds() == 0 && Clock::now() - begin > kFirstSound)
      return failure(ErrorCode::unavailable, input.device() + " sends nothing; choose another one with --device");
  }
  return {};
}

Result<std::string> run_record(RecordArguments a) {
  std::error_code ignored;
  if (!a.overwrite && std::filesystem::exists(a.out, ignored))
    return failure(ErrorCode::exists, a.out + " is already there; give another name, or --overwrite");
  if (auto usable = check_output(a.out, "the recording", "OUT", {}); !usable) return tl::unexpected(usable.error());
  const StopSignal stop(StopSignal::HangUp::stops);  // before the server's threads begin
  a.input.rate_hz = static_cast<unsigned>(a.rate_hz);
  a.input.channels = static_cast<unsigned>(a.channels);
  auto input = SoundInput::open(a.input);
  if (!input) return tl::unexpected(input.error());
  auto writer =
      sound::WavWriter::open(a.out, {.rate_hz = a.rate_hz, .channels = a.channels, .bits = a.bits},
                             sound::Unfinished::kept, a.overwrite ? sound::Older::replaced : sound::Older::kept);
  if (!writer) return tl::unexpected(writer.error());
  if (auto started = (*input)->start(); !started) return tl::unexpected(started.error());

  Result<void> outcome;
  std::string text;
  {
    Recording recording(a, **input, *writer);
    outcome = record_until_stopped(recording, **input, stop);
    (*input)->stop();
    if (auto taken = recording.take_all(); !taken && outcome) outcome = taken;
    text = report(a, **input, recording.meter());
  }
  if (writer->frames() == 0)
    return outcome ? failure(ErrorCode::cancelled, "stopped before a sound came; " + a.out + " was not written")
                   : tl::unexpected(outcome.error());
  // What was recorded cannot be recorded again: it is kept whatever ended it, and so is an older file.
  if (!outcome && std::filesystem::exists(a.out, ignored)) {
    const auto kept = writer->close_apart();
    if (!kept) return tl::unexpected(kept.error());
    return failure(outcome.error().code, outcome.error().message + "; " + kept->string() +
                                             " has what came until then, and " + a.out + " is as it was");
  }
  if (auto closed = writer->close(); !closed) return tl::unexpected(closed.error());
  if (!outcome)
    return failure(outcome.error().code, outcome.error().message + "; " + a.out + " has what came until then");
  return text;
}

}  // namespace

void add_record_command(CLI::App& app, std::function<Result<std::string>()>& chosen) {
  const auto shared = std::make_shared<RecordArguments>();
  RecordArguments& a = *shared;
  CLI::App* command = app.add_subcommand(
      "record", "Record a microphone, or another source of PulseAudio, until Ctrl+C: a drilling, to analyse or model");
  command->add_option("OUT", a.out, "WAV file for the sound, PCM")->required()->check(given_name());
  command->add_option("--seconds", a.seconds, "Length; without it, until Ctrl+C")->check(number_in(0.05, kLongest_s));
  command->add_option("--rate", a.rate_hz, "Samples in a second")
      ->check(CLI::Range(22050, 192000))
      ->capture_default_str();
  command->add_option("--bits", a.bits, "Of a sample: 16 or 24")->check(CLI::IsMember({16, 24}))->capture_default_str();
  command->add_option("--channels", a.channels, "1 or 2")->check(CLI::Range(1, 2))->capture_default_str();
  command->add_option(
      "--device", a.input.device,
      "Name or number of a source, as osteon-audio devices lists them, or a part of the name that no other has; "
      "by default PulseAudio's default source");
  command->add_flag("--overwrite", a.overwrite, "Replace a file of that name, when the new one is whole");
  command->callback([shared, &chosen] { chosen = [shared] { return run_record(*shared); }; });
}

}  // namespace osteon::audio
