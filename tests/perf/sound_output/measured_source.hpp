// A source of sound between an output and an engine: keeps what the engine renders, and what each call costs its
// thread.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "audio_client/output/audio_output.hpp"
#include "tests/perf/sound_output/frame_comparison.hpp"
#include "tests/support/allocation_counter.hpp"

namespace osteon::test {

class MeasuredSource final : public audio::SoundSource {
 public:
  // Memory for `most_frames` is taken now; later frames are played and not kept.
  MeasuredSource(audio::SoundSource& engine, std::size_t most_frames);
  void render(std::span<float> left, std::span<float> right) noexcept override;  // [audio]

  // From here on, after the output was stopped.
  [[nodiscard]] std::span<const Frame> frames() const noexcept { return std::span(frames_).first(frame_count_); }
  // Processor time of the thread from one call to the next: this callback, and what the output does with its frames. As
  // a share of the duration of those frames. A virtual machine counts the time that its host took from the thread, too.
  struct ThreadUse {
    std::int64_t from_ns = 0, to_ns = 0;  // steady clock
    double share = 0;
  };
  [[nodiscard]] std::vector<ThreadUse> thread_uses() const;
  [[nodiscard]] std::int64_t allocations() const noexcept { return allocations_; }                   // of the callback
  [[nodiscard]] std::int64_t allocations_of_thread() const noexcept { return thread_allocations_; }  // since its start
  [[nodiscard]] bool is_realtime() const noexcept { return is_realtime_; }

 private:
  struct Call {
    std::int64_t begin_ns = 0, begin_cpu_ns = 0;
    std::uint32_t frames = 0;
  };

  audio::SoundSource& engine_;
  std::vector<Frame> frames_;
  std::vector<Call> calls_;
  std::size_t frame_count_ = 0, call_count_ = 0;
  std::int64_t allocations_ = 0, thread_allocations_ = 0;
  std::optional<AllocationCounter> of_thread_;
  bool is_realtime_ = false;
};

}  // namespace osteon::test
