// Output without a sound card: the same calls at the same pace, by the monotonic clock. So recordings and logs stay
// correct.
#include <atomic>
#include <thread>
#include <vector>

#include "audio_client/output/audio_output.hpp"
#include "common/runtime/periodic.hpp"

namespace osteon::audio {
namespace {

class PacedOutput final : public AudioOutput {
 public:
  PacedOutput(const OutputParams& params, SoundSource& source)
      : params_(params), source_(source), left_(params.frames, 0.0F), right_(params.frames, 0.0F) {}
  ~PacedOutput() override { stop(); }

  Result<void> start() override {
    if (!thread_.joinable()) thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    return {};
  }

  void stop() noexcept override {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

  // Nothing is queued behind this buffer: its first frame would leave at once.
  std::chrono::nanoseconds latency() const noexcept override { return {}; }
  std::uint64_t gaps() const noexcept override { return gaps_.load(std::memory_order_relaxed); }
  std::uint64_t late_callbacks() const noexcept override { return late_.load(std::memory_order_relaxed); }
  std::string failure_reason() const override { return {}; }

 private:
  // After a stall it renders all missing frames at once, as a card with these buffers would have requested them. A
  // delay longer than all buffers counts as a gap, but is still rendered. So a recording lasts as long as the run.
  void run(const std::stop_token& stop) noexcept {
    try_realtime(20);
    using Clock = std::chrono::steady_clock;
    const std::chrono::nanoseconds period(1'000'000'000LL * params_.frames / params_.rate_hz);
    auto due = Clock::now();
    while (!stop.stop_requested()) {
      const auto now = Clock::now();
      if (now < due) {
        std::this_thread::sleep_until(due);
        continue;
      }
      if (now - due > period * params_.buffers) gaps_.fetch_add(1, std::memory_order_relaxed);
      if (now - due > period) late_.fetch_add(1, std::memory_order_relaxed);
      source_.render(left_, right_);
      due += period;
    }
  }

  OutputParams params_;
  SoundSource& source_;
  std::vector<float> left_, right_;
  std::atomic<std::uint64_t> gaps_{0}, late_{0};
  std::jthread thread_;
};

}  // namespace

std::unique_ptr<AudioOutput> make_paced_output(const OutputParams& params, SoundSource& source) {
  return std::make_unique<PacedOutput>(params, source);
}

}  // namespace osteon::audio
