// An audio output that reconnects: it opens its device again after the device was lost, or was missing at the start.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "audio_client/output/audio_output.hpp"

namespace osteon::audio {

// For one thread. No call waits for a device to come.
class ReconnectingOutput {
 public:
  using Clock = std::chrono::steady_clock;
  using Open = std::function<Result<std::unique_ptr<AudioOutput>>()>;
  static constexpr std::chrono::seconds kRetryInterval{2};  // from one attempt to the next

  explicit ReconnectingOutput(Open open) : open_(std::move(open)) {}

  // The first attempts. Errors: those of AudioOutput; trouble() keeps the sentence.
  [[nodiscard]] Result<void> open();
  [[nodiscard]] Result<void> start();
  [[nodiscard]] bool opened() const { return output_ != nullptr; }
  // Drops an output that has failed. `again`: opens and starts another one every kRetryInterval.
  void maintain(Clock::time_point now, bool again);
  void stop() noexcept;  // no frame is asked for afterwards, until maintain() starts an output

  // One sentence that says why nothing is played. Empty: the sound is played.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] std::chrono::nanoseconds latency() const;  // 0 without an output
  [[nodiscard]] std::uint64_t gaps() const;                // of all outputs
  [[nodiscard]] std::uint64_t late_callbacks() const;      // of all outputs

 private:
  [[nodiscard]] Result<void> fail(Error error);

  Open open_;
  std::unique_ptr<AudioOutput> output_;
  std::string trouble_ = "the sound has not begun yet";
  Clock::time_point tried_{};
  std::uint64_t earlier_gaps_ = 0, earlier_late_ = 0;  // of outputs that are gone
};

}  // namespace osteon::audio
