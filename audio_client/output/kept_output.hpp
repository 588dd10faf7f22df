// An output that is opened again when its device went away, or was not there at first.
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
class KeptOutput {
 public:
  using Clock = std::chrono::steady_clock;
  using Open = std::function<Result<std::unique_ptr<AudioOutput>>()>;
  static constexpr std::chrono::seconds kAgain{2};  // from one attempt to the next

  explicit KeptOutput(Open open) : open_(std::move(open)) {}

  // The first attempts. An error is also that of trouble().
  [[nodiscard]] Result<void> open();
  [[nodiscard]] Result<void> start();
  [[nodiscard]] bool opened() const { return output_ != nullptr; }
  // Drops an output that has failed. `again`: opens and starts another when it is time.
  void keep(Clock::time_point now, bool again);
  void stop() noexcept;  // no frame is asked for afterwards, until keep() starts an output

  // Why nothing is played, as one sentence; empty: it is played.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] std::chrono::nanoseconds latency() const;  // 0 without an output
  [[nodiscard]] std::uint64_t gaps() const;                // of all outputs

 private:
  [[nodiscard]] Result<void> fail(Error error);

  Open open_;
  std::unique_ptr<AudioOutput> output_;
  std::string trouble_ = "the sound has not begun yet";
  Clock::time_point tried_{};
  std::uint64_t earlier_gaps_ = 0;  // of outputs that are gone
};

}  // namespace osteon::audio
