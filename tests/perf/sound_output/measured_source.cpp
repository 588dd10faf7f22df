#include "tests/perf/sound_output/measured_source.hpp"

#include <sched.h>
#include <time.h>

#include <algorithm>

namespace osteon::test {
namespace {

constexpr std::size_t kLeastCall_frames = 32;

std::int64_t now_ns(clockid_t clock) noexcept {
  timespec time{};
  ::clock_gettime(clock, &time);
  return 1'000'000'000LL * time.tv_sec + time.tv_nsec;
}

}  // namespace

MeasuredSource::MeasuredSource(audio::SoundSource& engine, std::size_t most_frames)
    : engine_(engine), frames_(most_frames), calls_(most_frames / kLeastCall_frames) {}

void MeasuredSource::render(std::span<float> left, std::span<float> right) noexcept {
  if (call_count_ < calls_.size())
    calls_[call_count_++] = {now_ns(CLOCK_MONOTONIC), now_ns(CLOCK_THREAD_CPUTIME_ID),
                             static_cast<std::uint32_t>(left.size())};
  if (!of_thread_) {
    of_thread_.emplace();
    const int policy = ::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
    is_realtime_ = policy == SCHED_RR || policy == SCHED_FIFO;
  }
  thread_allocations_ = of_thread_->count();
  const AllocationCounter own;
  engine_.render(left, right);
  allocations_ += own.count();
  const std::size_t kept = std::min(left.size(), frames_.size() - frame_count_);
  for (std::size_t i = 0; i < kept; ++i) frames_[frame_count_ + i] = {left[i], right[i]};
  frame_count_ += kept;
}

std::vector<MeasuredSource::ThreadUse> MeasuredSource::thread_uses() const {
  std::vector<ThreadUse> uses;
  for (std::size_t i = 1; i < call_count_; ++i) {
    const Call &call = calls_[i - 1], &next = calls_[i];
    uses.push_back({call.begin_ns, next.begin_ns,
                    1e-9 * static_cast<double>(next.begin_cpu_ns - call.begin_cpu_ns) * 48000.0 / call.frames});
  }
  return uses;
}

}  // namespace osteon::test
