// Where sound goes: a sound server through RtAudio, or nowhere at the same pace. Both ask one source for frames.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "common/core/result.hpp"

namespace osteon::audio {

// Makes the sound. render() runs on the output's thread: no allocation, lock, log, exception or system call.
class SoundSource {
 public:
  virtual ~SoundSource() = default;
  virtual void render(std::span<float> mono) noexcept = 0;  // [audio]
};

enum class OutputKind { pulse, none };
[[nodiscard]] Result<OutputKind> output_kind(std::string_view name);

struct OutputParams {
  OutputKind kind = OutputKind::pulse;
  unsigned rate_hz = 48000;
  unsigned frames = 256;  // in one buffer
  unsigned buffers = 4;   // ahead of the sound card; two were heard to leave rare gaps on PulseAudio
};

class AudioOutput {
 public:
  virtual ~AudioOutput() = default;
  [[nodiscard]] virtual Result<void> start() = 0;
  virtual void stop() noexcept = 0;  // render() is not called any more when it returns

  // From the start of render() until its first frame leaves the buffers. RtAudio 5.2 does not report what PulseAudio
  // really holds, so this is the upper bound: all buffers that this output asked for, full.
  [[nodiscard]] virtual std::chrono::nanoseconds latency() const noexcept = 0;
  // Times that render() was called later than all buffers last, so that the sound had a gap.
  [[nodiscard]] virtual std::uint64_t gaps() const noexcept = 0;
  // Empty while all is well, else why no sound comes out any more: one sentence.
  [[nodiscard]] virtual std::string failure_reason() const = 0;
};

// Opens, does not start. The source must outlive the output. Error: unavailable, with the remedy.
[[nodiscard]] Result<std::unique_ptr<AudioOutput>> open_output(const OutputParams& params, SoundSource& source);

// The outputs behind open_output().
[[nodiscard]] Result<std::unique_ptr<AudioOutput>> open_pulse_output(const OutputParams& params, SoundSource& source);
[[nodiscard]] std::unique_ptr<AudioOutput> make_paced_output(const OutputParams& params, SoundSource& source);

}  // namespace osteon::audio
