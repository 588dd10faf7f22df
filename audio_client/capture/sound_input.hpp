// A source of the sound server, such as a microphone, through RtAudio (Figure 8.4).
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "audio_client/device/sound_device.hpp"
#include "common/core/result.hpp"

namespace osteon::audio {

struct InputParams {
  std::string device;  // one of input_devices(), as chosen_device() takes it
  unsigned rate_hz = 48000;
  unsigned channels = 1;  // 1 or 2
};

// Some frames as they came, interleaved.
struct InputPiece {
  static constexpr std::size_t kMostSamples = 512;
  std::array<float, kMostSamples> samples;
  std::uint32_t count = 0;

  [[nodiscard]] std::span<const float> used() const { return std::span(samples).first(count); }
};

// The sound server's thread pushes into a fixed queue, which one other thread empties.
class SoundInput {
 public:
  // Errors: unavailable (no server, no source), those of chosen_device().
  [[nodiscard]] static Result<std::unique_ptr<SoundInput>> open(const InputParams& params);
  ~SoundInput();

  [[nodiscard]] Result<void> start();
  void stop() noexcept;  // nothing is pushed afterwards
  // What has come since the last call, oldest first. False if there is nothing.
  [[nodiscard]] bool take(InputPiece& piece) noexcept;

  [[nodiscard]] const std::string& device() const;           // its full name
  [[nodiscard]] std::uint64_t frames_lost() const noexcept;  // because the queue of about 10 s was full
  [[nodiscard]] std::string failure_reason() const;          // one sentence; empty while the source works

 private:
  struct Impl;
  explicit SoundInput(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// The sources, in RtAudio's order; none is no error. Error: unavailable, with the remedy.
[[nodiscard]] Result<std::vector<SoundDevice>> input_devices();

}  // namespace osteon::audio
