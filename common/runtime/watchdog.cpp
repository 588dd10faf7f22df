#include "common/runtime/watchdog.hpp"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <utility>

namespace osteon {

Watchdog::Watchdog(std::chrono::nanoseconds patience, int priority, std::function<void()> late)
    : patience_(patience), late_(std::move(late)), thread_([this, priority] { watch(priority); }) {}

Watchdog::~Watchdog() {
  over_ = true;
  thread_.join();
}

void Watchdog::watch(int priority) {
  if (priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = priority;
    ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameters);
  }
  using Clock = std::chrono::steady_clock;
  std::uint64_t seen = 0;
  auto heard = Clock::now();
  bool stalled = false;
  while (!over_) {
    std::this_thread::sleep_for(patience_ / 4);
    const auto now = Clock::now();
    const std::uint64_t beats = beats_.load(std::memory_order_relaxed);
    const bool silent = beats == seen && beats != resting_.load(std::memory_order_relaxed);
    if (!silent) {
      seen = beats;
      heard = now;
      stalled = false;
      continue;
    }
    const auto silence = std::chrono::nanoseconds(now - heard);
    if (silence < patience_) continue;
    longest_ns_.store(std::max<std::int64_t>(longest_ns_.load(std::memory_order_relaxed), silence.count()),
                      std::memory_order_relaxed);
    if (std::exchange(stalled, true)) continue;
    stalls_.fetch_add(1, std::memory_order_relaxed);
    if (late_) late_();
  }
}

}  // namespace osteon
