// osteon-audio: joins a room and plays the sound of its tools, makes that of a recorded session, or records, analyses
// or models a sound, or makes a preset of it.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "audio_client/app/analyse_command.hpp"
#include "audio_client/app/devices_command.hpp"
#include "audio_client/app/listening_option.hpp"
#include "audio_client/app/model_command.hpp"
#include "audio_client/app/output_file.hpp"
#include "audio_client/app/preset_command.hpp"
#include "audio_client/app/record_command.hpp"
#include "audio_client/app/recording_option.hpp"
#include "audio_client/app/render_command.hpp"
#include "audio_client/net/state_subscription.hpp"
#include "audio_client/output/audio_output.hpp"
#include "audio_client/output/reconnecting_output.hpp"
#include "audio_client/output/sound_engine.hpp"
#include "audio_client/output/wav_recorder.hpp"
#include "audio_client/synth/sound_scene.hpp"
#include "common/core/mutex.hpp"
#include "common/input/sound_link.hpp"
#include "common/runtime/command_line.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/number_option.hpp"
#include "common/runtime/stop_signal.hpp"
#include "common/wire/room_client.hpp"

namespace {

using namespace osteon;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr const char* kProgram = "osteon-audio";
constexpr auto kPoll = 20ms;
constexpr auto kReport = 50ms;  // to a window, from one to the next
// Tools whose state was not received for so long run down. A working server passes on up to 60 of each a second.
constexpr auto kStale = 2s;
// Running down takes at most half a second. An output that does not continue must not block the program.
constexpr auto kRunDown = 2s;

struct Options {
  std::string server, room, name = "audio";
  wire::CredentialArguments credentials;
  std::string output = "pulse", device;
  audio::ListeningOption listening;
  std::filesystem::path wav_file, state_log_file, summary_file, window;
  std::vector<std::string> presets;
  bool overwrite = false;
  double patience_s = 5;
};

// Rows of the state log, and the latency computed from them.
//
// sounded_mono_ns is a sum. It begins with the start of the render() call that first used the state. The frames that
// the synthesis looks ahead are added (64, 1.3 ms), and the way of the sound to the usual listener (0.6 or 1.5 ms; none
// in mono). The output's latency is added: all buffers in front of the card,
// full (4 x 256 frames, 21.3 ms). On PulseAudio this is an upper bound; the monitor of a null sink receives a frame 7
// ms earlier (deploy/docs/sound.md).
class StateLog {
 public:
  [[nodiscard]] Result<void> open(const std::filesystem::path& file) {
    if (file.empty()) return {};
    file_.open(file);
    file_ << "state_seq,received_mono_ns,sounded_mono_ns,author\n";
    if (!file_)
      return failure(ErrorCode::internal, "cannot write the state log " + file.string() +
                                              "; give --state-log a file in a folder that exists");
    return {};
  }

  void drain(audio::SoundEngine& engine, const audio::ReconnectingOutput& output) {
    audio::Sounded sounded;
    errno = 0;
    while (engine.next_sounded(sounded)) {
      const auto delay = engine.latency() + output.latency();
      const std::int64_t sounded_ns = sounded.rendered_ns + std::chrono::nanoseconds(delay).count();
      latency_.record(std::chrono::nanoseconds(sounded_ns - sounded.received_ns));
      if (file_.is_open())
        file_ << sounded.state_seq << ',' << sounded.received_ns << ',' << sounded_ns << ',' << sounded.author << '\n';
    }
    note_reason();
  }

  [[nodiscard]] Result<void> close(const std::filesystem::path& file) {
    if (!file_.is_open()) return {};
    errno = 0;
    file_.close();
    note_reason();
    if (reason_ == 0) return {};
    return failure(ErrorCode::internal, "the state log " + file.string() + " could not be written whole (" +
                                            std::generic_category().message(reason_) +
                                            "); make room on the disk, or give --state-log a file on another one");
  }

  [[nodiscard]] const DurationHistogram& latency() const { return latency_; }

 private:
  // Later calls fail without one.
  void note_reason() {
    if (!file_ && reason_ == 0) reason_ = errno != 0 ? errno : EIO;
  }

  std::ofstream file_;
  int reason_ = 0;
  DurationHistogram latency_;
};

nlohmann::json summary_of(const Options& options, const audio::SoundEngine& engine,
                          const audio::ReconnectingOutput& output, const StateLog& states,
                          const std::optional<audio::WavRecorder>& recorder) {
  const double peak = engine.peak();
  nlohmann::json summary = {
      {"output", options.output},
      {"listen", options.listening.listen},
      {"frames", engine.frames()},
      // With the session log's mono_ns, this gives the position of a moment of the work in the recording.
      {"first_frame_mono_ns", engine.first_frame_ns() + output.latency().count()},
      {"seconds", static_cast<double>(engine.frames()) / 48000.0},
      // PulseAudio's own underruns do not reach RtAudio 5.2. These are the calls that came too late to fill the
      // buffers.
      {"gaps", output.gaps()},
      {"late_callbacks", output.late_callbacks()},
      {"states_sounded", states.latency().count()},
      {"callback_work",
       {{"p50_us", engine.work().percentile_us(50)},
        {"p99_us", engine.work().percentile_us(99)},
        {"max_us", engine.work().max_us()}}},
      {"received_to_sounded",
       {{"p50_ms", states.latency().percentile_us(50) / 1000},
        {"p99_ms", states.latency().percentile_us(99) / 1000},
        {"max_ms", states.latency().max_us() / 1000}}},
      {"output_latency_ms", std::chrono::duration<double, std::milli>(output.latency()).count()},
      {"peak", peak},
      {"peak_left", engine.peak(0)},
      {"peak_right", engine.peak(1)},
      {"peak_db", peak > 0 ? nlohmann::json(20.0 * std::log10(peak)) : nlohmann::json(nullptr)},
  };
  if (recorder) {
    summary["wav_frames"] = recorder->frames_written();
    summary["wav_frames_lost"] = recorder->frames_lost();
  }
  return summary;
}

// The window that started this program. It says how loud the sound is, and shows what is played.
class Window {
 public:
  [[nodiscard]] static Result<Window> connect(const Options& options) {
    if (options.window.empty()) return Window({}, {});
    auto link = SoundClient::connect(options.window);
    if (!link) return failure(link.error().code, "--window: " + link.error().message);
    return Window(std::move(*link), options.output == "pulse" ? "PulseAudio" : options.output);
  }

  [[nodiscard]] bool there() const { return link_ != nullptr; }

  void attend(audio::SoundEngine& engine, const audio::ReconnectingOutput& output, unsigned rate_hz) {
    if (!link_) return;
    if (const std::optional<SoundSettings> settings = link_->wait(0))
      engine.set_volume(settings->on ? settings->volume : 0.0);
    if (output.trouble() != said_ && !output.trouble().empty()) log::warn("no sound", {{"why", output.trouble()}});
    said_ = output.trouble();
    if (Clock::now() - reported_ < kReport) return;
    reported_ = Clock::now();
    link_->send(report(engine, output, rate_hz));
  }

 private:
  Window(std::unique_ptr<SoundClient> link, std::string device) : link_(std::move(link)), device_(std::move(device)) {}

  [[nodiscard]] SoundReport report(audio::SoundEngine& engine, const audio::ReconnectingOutput& output,
                                   unsigned rate_hz) const {
    using Milliseconds = std::chrono::duration<double, std::milli>;
    SoundReport report;
    report.rate_hz = rate_hz;
    report.trouble = output.trouble();
    report.gaps = static_cast<double>(output.gaps());
    report.late_callbacks = static_cast<double>(output.late_callbacks());
    if (!report.trouble.empty()) return report;
    report.device = device_;
    for (const float x : engine.wave())
      report.wave.push_back(static_cast<int>(std::lround(std::clamp(x, -1.0F, 1.0F) * kFullScale)));
    report.level = std::min(1.0F, engine.take_level());
    report.work_ms = Milliseconds(engine.take_longest_work()).count();
    report.buffer_ms = 1e3 * static_cast<double>(engine.buffer_frames()) / rate_hz;
    report.latency_ms = Milliseconds(engine.latency() + output.latency()).count();
    return report;
  }

  std::unique_ptr<SoundClient> link_;
  std::string device_, said_;
  Clock::time_point reported_;
};

// No file that is written is another one that is written, or a preset that is read.
Result<void> check_outputs(const Options& options) {
  std::vector<audio::OtherFile> others;
  for (const std::string& preset : options.presets) others.push_back({preset, "a preset"});
  const std::tuple<const char*, std::filesystem::path, const char*> written[] = {
      {"--wav", options.wav_file, "the recording"},
      {"--state-log", options.state_log_file, "the state log"},
      {"--summary", options.summary_file, "the summary"}};
  for (const auto& [option, file, what] : written) {
    if (Result<void> apart = audio::check_apart(file.string(), option, others); !apart) return apart;
    others.push_back({file.string(), what});
  }
  std::error_code ignored;
  if (!options.overwrite && std::filesystem::exists(options.wav_file, ignored))
    return failure(ErrorCode::exists,
                   options.wav_file.string() + " is already there; give --wav another name, or add --overwrite");
  return {};
}

// What is read before anything is opened or written.
struct Prepared {
  wire::ClientCredentials credentials;
  audio::OutputParams output;
  audio::SynthParams synth;
  audio::Space space;  // the middle of the bone is not known yet
};

// Errors on this machine are found before the server is contacted.
Result<Prepared> prepare(const Options& options) {
  Prepared prepared;
  Result<wire::ClientCredentials> credentials = wire::client_credentials(options.credentials);
  if (!credentials) return tl::unexpected(credentials.error());
  prepared.credentials = std::move(*credentials);
  const Result<audio::OutputKind> kind = audio::output_kind(options.output);
  if (!kind) return tl::unexpected(kind.error());
  prepared.output.kind = *kind;
  prepared.output.device = options.device;
  if (!options.device.empty() && *kind != audio::OutputKind::pulse)
    return failure(ErrorCode::invalid_input, "--device is a sink of PulseAudio; use --output pulse with it");

  if (Result<void> usable = check_writable(options.state_log_file, "the state log", "--state-log"); !usable)
    return tl::unexpected(usable.error());
  for (const auto& [file, what, option] : {std::tuple{options.wav_file, "the recording", "--wav"},
                                           std::tuple{options.summary_file, "the summary", "--summary"}})
    if (Result<void> usable = audio::check_output(file.string(), what, option, {}); !usable)
      return tl::unexpected(usable.error());
  if (Result<void> apart = check_outputs(options); !apart) return tl::unexpected(apart.error());
  Result<std::vector<audio::ToolModel>> presets = audio::presets_of(options.presets);
  if (!presets) return tl::unexpected(presets.error());
  prepared.synth.rate_hz = prepared.output.rate_hz;
  prepared.synth.presets = std::move(*presets);
  Result<audio::Space> space = audio::read(options.listening, prepared.output.rate_hz);
  if (!space) return tl::unexpected(space.error());
  prepared.space = std::move(*space);
  return prepared;
}

Result<void> run(const Options& options, Prepared prepared, const StopSignal& stop) {
  const audio::OutputParams& output_params = prepared.output;
  audio::Space& space = prepared.space;
  std::optional<audio::WavRecorder> recorder;
  audio::SoundEngine engine(prepared.synth);
  Result<Window> window = Window::connect(options);
  if (!window) return tl::unexpected(window.error());
  if (window->there()) engine.set_volume(0.0);  // until the window has said how loud
  audio::ReconnectingOutput output([&] { return audio::open_output(output_params, engine); });
  // With a window, a device that is missing is reported there, and looked for again.
  if (Result<void> opened = output.open(); !opened && !window->there()) return opened;

  Result<wire::JoinedRoom> room = wire::join_room(
      options.server, wire::ClientKind::audio, options.name,
      std::chrono::milliseconds(static_cast<std::int64_t>(1000 * options.patience_s)), [&] { return stop.requested(); },
      options.room, prepared.credentials);
  // A stop was requested, perhaps before the server answered.
  if (!room && room.error().code == ErrorCode::cancelled) return {};
  if (!room) return tl::unexpected(room.error());

  // Opened only now: opening empties the files, and without a server an earlier recording must stay.
  // The recording first, because another program may have its name.
  if (!options.wav_file.empty()) {
    Result<audio::WavRecorder> opened = audio::WavRecorder::open(
        options.wav_file, output_params.rate_hz, space.listening == audio::Listening::mono ? 1 : 2,
        options.overwrite ? audio::Existing::replaced : audio::Existing::refused);
    if (!opened) return tl::unexpected(opened.error());
    recorder = std::move(*opened);
    engine.record_to(*recorder);
  }
  StateLog states;
  if (Result<void> opened = states.open(options.state_log_file); !opened) return opened;
  audio::move_to_middle(space, room->bounds.centre_mm());
  engine.listen(space);
  if (output.opened())
    if (Result<void> started = output.start(); !started && !window->there()) {
      std::error_code ignored;
      // It has no sound, and the next start would refuse its name.
      if (recorder && !options.overwrite) std::filesystem::remove(options.wav_file, ignored);
      return started;
    }
  log::info("joined", {{"server", options.server}, {"case", room->case_title}, {"output", options.output}});

  // The reader and this thread deliver one at a time. Guards the engine's input and `received_at`; clang checks no
  // locals.
  Mutex delivering{LockRank::leaf};
  // When the last message was received; none while everything is at rest.
  std::optional<Clock::time_point> received_at;
  auto watch = StateSubscription::start(
      std::move(*room), [&](const std::vector<CuttingState>& tools, Clock::time_point received) {
        const audio::SoundScene scene = audio::sound_scene(tools, received.time_since_epoch().count());
        const MutexLock lock(delivering);
        engine.deliver(scene);
        received_at = received;
      });

  std::optional<Error> broken;
  bool recording = recorder.has_value();
  while (!broken && !stop.wait_for(kPoll)) {
    states.drain(engine, output);
    window->attend(engine, output, output_params.rate_hz);
    if (const MutexLock lock(delivering); received_at && Clock::now() - *received_at > kStale) {
      engine.deliver(audio::SoundScene{});
      received_at.reset();
    }
    // The sound goes on without it.
    if (recording && !recorder->trouble().empty()) {
      recording = false;
      log::warn("the recording has ended", {{"why", recorder->trouble()}});
    }
    broken = watch->ended();
    output.maintain(Clock::now(), window->there());
    if (!window->there() && !output.trouble().empty()) broken = Error{ErrorCode::unavailable, output.trouble()};
  }

  // The tools run down as if their motors had been switched off, so there is no click at the end. The reader has ended
  // here.
  watch.reset();
  engine.deliver(audio::SoundScene{});
  const auto end = Clock::now() + kRunDown;
  std::this_thread::sleep_for(2 * kPoll);
  while (!engine.silent() && output.trouble().empty() && Clock::now() < end) {
    std::this_thread::sleep_for(kPoll);
    output.maintain(Clock::now(), false);
  }
  output.stop();
  states.drain(engine, output);

  // All files are finished before the first error is reported.
  Result<void> outcome = broken ? Result<void>(tl::unexpected(*broken)) : Result<void>();
  const auto keep_first = [&](Result<void> result) {
    if (outcome && !result) outcome = std::move(result);
  };
  keep_first(states.close(options.state_log_file));
  if (recorder) keep_first(recorder->close());
  const nlohmann::json summary = summary_of(options, engine, output, states, recorder);
  if (!options.summary_file.empty()) keep_first(write_file(options.summary_file, summary.dump(2) + "\n"));
  log::info("stopped", {{"seconds", static_cast<double>(engine.frames()) / output_params.rate_hz},
                        {"states", states.latency().count()},
                        {"gaps", output.gaps()},
                        {"callback_p99_us", engine.work().percentile_us(99)},
                        {"received_to_sounded_p50_ms", states.latency().percentile_us(50) / 1000}});
  return outcome;
}

}  // namespace

int main(int argc, char** argv) try {
  Options options;
  CLI::App app("Plays the sound of a room's tools: it follows speed, load and bone density.", kProgram);
  std::function<Result<std::string>()> command;
  audio::add_analyse_command(app, command);
  audio::add_model_commands(app, command);
  audio::add_devices_command(app, command);
  audio::add_preset_command(app, command);
  audio::add_render_command(app, command);
  audio::add_record_command(app, command);
  app.require_subcommand(0, 1);
  app.add_option("--server", options.server, "HOST:PORT of osteon-server; needed to play");
  app.add_option("--room", options.room, "Name of the room; not needed where the server has one");
  app.add_option("--name", options.name, "Who you are, shown to others")->capture_default_str();
  wire::add_credential_options(app, options.credentials);
  app.add_option("--output", options.output, "pulse: a sink of PulseAudio; none: at the same pace to nowhere")
      ->capture_default_str();
  app.add_option(
      "--device", options.device,
      "Name or number of a sink, as osteon-audio devices lists them, or a part of the name that no other has; "
      "by default, the server's own choice");
  audio::add_listening(app, options.listening, "the bone");
  app.add_option("--preset", options.presets,
                 "Preset of a tool's sound, or a folder of presets, which go before those of Osteon; may be repeated")
      ->allow_extra_args(false);
  app.add_option("--wav", options.wav_file,
                 "Record the sound: 48 kHz, 16 bit, both channels, or one with --listen mono")
      ->check(audio::given_name());
  app.add_flag("--overwrite", options.overwrite, "Replace an existing file of --wav")->needs("--wav");
  app.add_option("--state-log", options.state_log_file,
                 "CSV: when each cutting state was received and when it was played")
      ->check(audio::given_name());
  app.add_option("--summary", options.summary_file, "JSON written at the end: frames, latencies, callback work, peak")
      ->check(audio::given_name());
  app.add_option("--window", options.window,
                 "Socket of the window osteon, which starts this program by itself: the window sets the volume and "
                 "shows the sound. A missing sound server is then waited for");
  app.add_option("--timeout", options.patience_s, "Seconds to wait for the server")
      ->check(number_in(0.0, 3600.0))
      ->capture_default_str();
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  if (command) {
    const Result<std::string> text = command();
    if (!text) return log::exit_with(kProgram, text.error());
    if (std::fputs(text->c_str(), stdout) >= 0 && std::fflush(stdout) == 0) return 0;
    return log::exit_with(
        kProgram, {ErrorCode::internal, "cannot write the result to standard output: " +
                                            std::generic_category().message(errno) + "; send it to another file"});
  }
  if (options.server.empty())
    return log::exit_with(kProgram, {ErrorCode::invalid_input, "--server is required; see osteon-audio --help"});

  log::open(kProgram);
  // A large head takes seconds. Until it is there, Ctrl+C ends the program at once.
  Result<Prepared> prepared = prepare(options);
  if (!prepared) return log::exit_with(kProgram, prepared.error());
  const StopSignal stop(StopSignal::HangUp::stops);
  const Result<void> outcome = run(options, std::move(*prepared), stop);
  return outcome ? 0 : log::exit_with(kProgram, outcome.error());
} catch (const std::exception& fault) {
  return log::exit_with(kProgram,
                        {ErrorCode::internal, std::string("cannot go on: ") + fault.what() +
                                                  "; free memory if it is short, or report a fault of Osteon"});
}
