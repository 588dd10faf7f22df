// Outputs for sound: a sound server through RtAudio, or no output at the same pace. Both request frames from one
// source.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "audio_client/device/sound_device.hpp"
#include "common/core/result.hpp"

namespace osteon::audio {

// Makes the sound. render() runs on the output's thread: no allocation, lock, log, exception or system call.
class SoundSource {
 public:
  virtual ~SoundSource() = default;
  // Fills both channels, of equal sizes. [audio]
  virtual void render(std::span<float> left, std::span<float> right) noexcept = 0;
};

enum class OutputKind { pulse, none };
[[nodiscard]] Result<OutputKind> output_kind(std::string_view name);

struct OutputParams {
  OutputKind kind = OutputKind::pulse;
  unsigned rate_hz = 48000;
  unsigned frames = 256;  // in one buffer
  unsigned buffers = 4;   // ahead of the sound card; two left rare audible gaps on PulseAudio
  std::string device{};   // a sink of output_devices(), as chosen_device() takes it
};

class AudioOutput {
 public:
  virtual ~AudioOutput() = default;
  [[nodiscard]] virtual Result<void> start() = 0;
  virtual void stop() noexcept = 0;  // after it returns, render() is not called any more

  // Time from the start of render() until its first frame leaves the buffers. RtAudio 5.2 does not report what
  // PulseAudio really holds. So this is the upper bound: all buffers that this output requested, full.
  [[nodiscard]] virtual std::chrono::nanoseconds latency() const noexcept = 0;
  // Number of times that render() was called later than the duration of all buffers, so that the sound had a gap.
  [[nodiscard]] virtual std::uint64_t gaps() const noexcept = 0;
  // Number of times that render() was called more than a buffer's duration late. Only those that are also gaps are
  // heard.
  [[nodiscard]] virtual std::uint64_t late_callbacks() const noexcept = 0;
  // Why no sound is played any more, as one sentence; empty while the output works.
  [[nodiscard]] virtual std::string failure_reason() const = 0;
};

// Opens the output without starting it. The source must outlive the output. Error: unavailable, with the remedy.
[[nodiscard]] Result<std::unique_ptr<AudioOutput>> open_output(const OutputParams& params, SoundSource& source);

// The sinks, in RtAudio's order. Error: unavailable, with the remedy.
[[nodiscard]] Result<std::vector<SoundDevice>> output_devices();

// The outputs that open_output() makes.
[[nodiscard]] Result<std::unique_ptr<AudioOutput>> open_pulse_output(const OutputParams& params, SoundSource& source);
[[nodiscard]] std::unique_ptr<AudioOutput> make_paced_output(const OutputParams& params, SoundSource& source);

}  // namespace osteon::audio
