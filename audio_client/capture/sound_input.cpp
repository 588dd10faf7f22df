// RtAudio 5.2 on PulseAudio. Its exceptions are caught here.
#include "audio_client/capture/sound_input.hpp"

#include <rtaudio/RtAudio.h>

#include <algorithm>
#include <atomic>
#include <utility>
#include <vector>

#include "common/runtime/spsc_queue.hpp"

namespace osteon::audio {
namespace {

constexpr unsigned kInputFrames = 256;  // in one buffer: a level meter needs no more, and small buffers lose less

// RtAudio's error callback carries no user data, so the flag must be static. Only one input is open at a time.
std::atomic<bool> input_failed{false};

void on_input_error(RtAudioError::Type, const std::string&) { input_failed.store(true, std::memory_order_relaxed); }

tl::unexpected<Error> no_input(const std::string& what) {
  return failure(ErrorCode::unavailable,
                 "no source of sound answers (" + what + "); start PulseAudio, and connect a microphone");
}

// RtAudio's view of the server. It lists the sinks too, and numbers them together with the sources.
struct Sources {
  std::vector<SoundDevice> devices;
  std::vector<unsigned> ids;
};

Sources sources_of(RtAudio& audio) {
  Sources sources;
  for (unsigned id = 0; id < audio.getDeviceCount(); ++id) {
    const RtAudio::DeviceInfo info = audio.getDeviceInfo(id);
    if (!info.probed || info.inputChannels == 0) continue;
    sources.devices.push_back({info.name, info.inputChannels, info.preferredSampleRate, info.isDefaultInput});
    sources.ids.push_back(id);
  }
  return sources;
}

// Error: unavailable. There is no server.
Result<void> begin(RtAudio& audio) {
  if (audio.getCurrentApi() != RtAudio::LINUX_PULSE) return no_input("this RtAudio was built without PulseAudio");
  audio.showWarnings(false);
  if (audio.getDeviceCount() == 0) return no_input("no sound server answers");
  return {};
}

}  // namespace

struct SoundInput::Impl {
  InputParams params;
  RtAudio audio{RtAudio::LINUX_PULSE};
  std::string device;
  SpscQueue<InputPiece, 2048> queue;
  std::atomic<std::uint64_t> lost{0};

  // [audio]
  static int callback(void*, void* in, unsigned frames, double, RtAudioStreamStatus, void* self) {
    Impl& impl = *static_cast<Impl*>(self);
    // Without its server, RtAudio calls on and on with the last buffer, faster than sound.
    if (!input_failed.load(std::memory_order_relaxed))
      impl.push({static_cast<const float*>(in), std::size_t{frames} * impl.params.channels});
    return 0;
  }

  // [audio]
  void push(std::span<const float> samples) noexcept {
    while (!samples.empty()) {
      InputPiece piece;
      piece.count = static_cast<std::uint32_t>(std::min(samples.size(), piece.samples.size()));
      std::copy_n(samples.begin(), piece.count, piece.samples.begin());
      if (!queue.try_push(piece)) lost.fetch_add(piece.count / params.channels, std::memory_order_relaxed);
      samples = samples.subspan(piece.count);
    }
  }

  Result<void> open() {
    if (auto begun = begin(audio); !begun) return begun;
    const Sources sources = sources_of(audio);
    if (sources.devices.empty()) return no_input("it names no source");
    const auto source = chosen_device(sources.devices, params.device, "source");
    if (!source) return tl::unexpected(source.error());
    device = sources.devices[*source].name;
    RtAudio::StreamParameters from;
    from.deviceId = sources.ids[*source];
    from.nChannels = params.channels;
    RtAudio::StreamOptions options;
    options.streamName = "Osteon recording";
    unsigned frames = kInputFrames;
    input_failed = false;
    audio.openStream(nullptr, &from, RTAUDIO_FLOAT32, params.rate_hz, &frames, &Impl::callback, this, &options,
                     &on_input_error);
    if (!audio.isStreamOpen() || input_failed) return no_input(device + " refuses a stream");
    return {};
  }

  ~Impl() {
    try {
      if (audio.isStreamOpen()) audio.closeStream();
    } catch (const RtAudioError&) {
      input_failed = true;  // the server is gone: there is nothing left to close
    }
  }
};

SoundInput::SoundInput(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

SoundInput::~SoundInput() { stop(); }

Result<std::unique_ptr<SoundInput>> SoundInput::open(const InputParams& params) {
  try {
    auto impl = std::make_unique<Impl>();
    impl->params = params;
    if (auto opened = impl->open(); !opened) return tl::unexpected(opened.error());
    return std::unique_ptr<SoundInput>(new SoundInput(std::move(impl)));
  } catch (const RtAudioError& error) {
    return no_input(error.getMessage());
  }
}

Result<void> SoundInput::start() {
  try {
    impl_->audio.startStream();
    if (!impl_->audio.isStreamRunning()) return no_input("the stream does not start");
    return {};
  } catch (const RtAudioError& error) {
    return no_input(error.getMessage());
  }
}

void SoundInput::stop() noexcept {
  try {
    if (impl_->audio.isStreamRunning()) impl_->audio.stopStream();
  } catch (const RtAudioError&) {
    input_failed = true;
  }
}

bool SoundInput::take(InputPiece& piece) noexcept { return impl_->queue.try_pop(piece); }

const std::string& SoundInput::device() const { return impl_->device; }

std::uint64_t SoundInput::frames_lost() const noexcept { return impl_->lost.load(std::memory_order_relaxed); }

std::string SoundInput::failure_reason() const {
  if (!input_failed.load(std::memory_order_relaxed)) return {};
  return "the sound server or its source went away";
}

Result<std::vector<SoundDevice>> input_devices() {
  try {
    RtAudio audio(RtAudio::LINUX_PULSE);
    if (auto begun = begin(audio); !begun) return tl::unexpected(begun.error());
    return std::move(sources_of(audio).devices);
  } catch (const RtAudioError& error) {
    return no_input(error.getMessage());
  }
}

}  // namespace osteon::audio
