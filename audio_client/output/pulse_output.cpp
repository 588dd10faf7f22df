// RtAudio 5.2 on PulseAudio. Its exceptions are caught here.
#include <pthread.h>
#include <rtaudio/RtAudio.h>
#include <sched.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <utility>
#include <vector>

#include "audio_client/output/audio_output.hpp"

namespace osteon::audio {
namespace {

constexpr unsigned kChannels = 2;
constexpr unsigned kMaxFrames = 4096;
constexpr int kPriority = 20;  // of the threads of the sound, if the system allows it

// RtAudio's error callback carries no user data, so the flag must be static. Only one output is open at a time.
std::atomic<bool> stream_failed{false};

void on_error(RtAudioError::Type, const std::string&) { stream_failed.store(true, std::memory_order_relaxed); }

tl::unexpected<Error> no_server(const std::string& what) {
  return failure(ErrorCode::unavailable,
                 "no sound server answers (" + what + "); start PulseAudio, or use --output none with --wav FILE");
}

// RtAudio raises the priority of its own thread only. A thread of libpulse carries the frames to the server, and has
// the priority of the thread that opened the stream. Without permission nothing changes.
class Raised {
 public:
  explicit Raised(int priority) noexcept {
    const sched_param raised{.sched_priority = priority};
    raised_ = pthread_getschedparam(pthread_self(), &policy_, &before_) == 0 &&
              pthread_setschedparam(pthread_self(), SCHED_RR, &raised) == 0;
  }
  ~Raised() {
    if (raised_) pthread_setschedparam(pthread_self(), policy_, &before_);
  }
  Raised(const Raised&) = delete;
  Raised& operator=(const Raised&) = delete;

 private:
  int policy_ = SCHED_OTHER;
  sched_param before_{};
  bool raised_ = false;
};

// RtAudio's view of the server. It lists the sources too, and numbers them together with the sinks.
struct PulseDevices {
  std::vector<SoundDevice> sinks;
  std::vector<unsigned> ids;  // of the sinks
};

Result<std::unique_ptr<RtAudio>> pulse() {
  auto audio = std::make_unique<RtAudio>(RtAudio::LINUX_PULSE);
  if (audio->getCurrentApi() != RtAudio::LINUX_PULSE) return no_server("this RtAudio was built without PulseAudio");
  audio->showWarnings(false);
  return audio;
}

Result<PulseDevices> devices_of(RtAudio& audio) {
  const unsigned count = audio.getDeviceCount();
  if (count == 0) return no_server("it names no device");
  PulseDevices devices;
  for (unsigned id = 0; id < count; ++id) {
    const RtAudio::DeviceInfo info = audio.getDeviceInfo(id);
    if (info.outputChannels == 0) continue;
    devices.sinks.push_back({info.name, info.outputChannels, info.preferredSampleRate, info.isDefaultOutput});
    devices.ids.push_back(id);
  }
  return devices;
}

class PulseOutput final : public AudioOutput {
 public:
  PulseOutput(const OutputParams& params, SoundSource& source) : params_(params), source_(source) {}
  ~PulseOutput() override { close(); }

  Result<void> open() {
    try {
      Result<std::unique_ptr<RtAudio>> audio = pulse();
      if (!audio) return tl::unexpected(audio.error());
      audio_ = std::move(*audio);
      const Result<PulseDevices> devices = devices_of(*audio_);
      if (!devices) return tl::unexpected(devices.error());
      const Result<std::size_t> chosen = chosen_device(devices->sinks, params_.device, "sink");
      if (!chosen) return tl::unexpected(chosen.error());
      RtAudio::StreamParameters to;
      to.deviceId = devices->ids[*chosen];
      to.nChannels = kChannels;
      RtAudio::StreamOptions options;
      options.numberOfBuffers = params_.buffers;  // 0 would let PulseAudio buffer 137 ms
      options.flags = RTAUDIO_SCHEDULE_REALTIME;
      options.priority = kPriority;
      options.streamName = "Osteon";
      unsigned frames = params_.frames;
      stream_failed = false;
      const Raised raised(kPriority);
      audio_->openStream(&to, nullptr, RTAUDIO_FLOAT32, params_.rate_hz, &frames, &PulseOutput::callback, this,
                         &options, &on_error);
      if (!audio_->isStreamOpen() || stream_failed) return no_server("it refuses a stream");
      if (frames > kMaxFrames) return no_server("it wants buffers of " + std::to_string(frames) + " frames");
      params_.frames = frames;
      return {};
    } catch (const RtAudioError& error) {
      return no_server(error.getMessage());
    }
  }

  Result<void> start() override {
    try {
      audio_->startStream();
      if (!audio_->isStreamRunning()) return no_server("the stream does not start");
      return {};
    } catch (const RtAudioError& error) {
      return no_server(error.getMessage());
    }
  }

  void stop() noexcept override {
    try {
      if (audio_ && audio_->isStreamRunning()) audio_->stopStream();
    } catch (const RtAudioError&) {
      stream_failed = true;  // the server is gone: there is nothing left to stop
    }
  }

  std::chrono::nanoseconds latency() const noexcept override {
    return std::chrono::nanoseconds(1'000'000'000LL * params_.frames * params_.buffers / params_.rate_hz);
  }
  std::uint64_t gaps() const noexcept override { return gaps_.load(std::memory_order_relaxed); }
  std::uint64_t late_callbacks() const noexcept override { return late_.load(std::memory_order_relaxed); }
  std::string failure_reason() const override {
    if (!stream_failed.load(std::memory_order_relaxed)) return {};
    return "the sound server went away; start it again, or use --output none with --wav FILE";
  }

 private:
  // [audio]
  static int callback(void* out, void*, unsigned frames, double, RtAudioStreamStatus, void* self) {
    // Without its server, RtAudio calls on and on, faster than sound. What is rendered then would be recorded.
    if (!stream_failed.load(std::memory_order_relaxed))
      static_cast<PulseOutput*>(self)->fill(static_cast<float*>(out), frames);
    else
      std::fill_n(static_cast<float*>(out), std::size_t{kChannels} * frames, 0.0F);
    return 0;
  }

  void fill(float* out, unsigned frames) noexcept {
    // PulseAudio's underruns do not reach RtAudio 5.2. A call that comes later than the duration of all buffers proves
    // one.
    const auto now = std::chrono::steady_clock::now();
    if (called_ && now - last_call_ > latency()) gaps_.fetch_add(1, std::memory_order_relaxed);
    if (called_ && now - last_call_ > 2 * latency() / params_.buffers) late_.fetch_add(1, std::memory_order_relaxed);
    called_ = true;
    last_call_ = now;
    const std::size_t count = std::min(frames, kMaxFrames);
    source_.render(std::span(left_).first(count), std::span(right_).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      out[kChannels * i] = left_[i];
      out[kChannels * i + 1] = right_[i];
    }
  }

  void close() noexcept {
    stop();
    try {
      if (audio_ && audio_->isStreamOpen()) audio_->closeStream();
    } catch (const RtAudioError&) {
      stream_failed = true;
    }
  }

  OutputParams params_;
  SoundSource& source_;
  std::unique_ptr<RtAudio> audio_;
  std::array<float, kMaxFrames> left_{}, right_{};
  std::atomic<std::uint64_t> gaps_{0}, late_{0};
  std::chrono::steady_clock::time_point last_call_;
  bool called_ = false;
};

}  // namespace

Result<std::vector<SoundDevice>> output_devices() {
  try {
    const Result<std::unique_ptr<RtAudio>> audio = pulse();
    if (!audio) return tl::unexpected(audio.error());
    Result<PulseDevices> devices = devices_of(**audio);
    if (!devices) return tl::unexpected(devices.error());
    return std::move(devices->sinks);
  } catch (const RtAudioError& error) {
    return no_server(error.getMessage());
  }
}

Result<std::unique_ptr<AudioOutput>> open_pulse_output(const OutputParams& params, SoundSource& source) {
  auto output = std::make_unique<PulseOutput>(params, source);
  if (const Result<void> opened = output->open(); !opened) return tl::unexpected(opened.error());
  return output;
}

}  // namespace osteon::audio
