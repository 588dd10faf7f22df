#include "common/runtime/watchdog.hpp"

#include <pthread.h>
#include <sched.h>

#include <utility>

namespace osteon {
namespace {

std::int64_t now_ns() noexcept { return std::chrono::steady_clock::now().time_since_epoch().count(); }

}  // namespace

Watchdog::Watchdog(std::chrono::nanoseconds patience, int priority, std::function<void()> late)
    : patience_(patience), late_(std::move(late)), thread_([this, priority] { watch(priority); }) {}

Watchdog::~Watchdog() {
  over_ = true;
  thread_.join();
}

void Watchdog::beat() noexcept {
  const std::int64_t now = now_ns(), last = beat_at_ns_.load(std::memory_order_relaxed);
  if (last != kResting && now - last > patience_.count()) {
    measure(now - last);
    stood_since_ns_.store(last, std::memory_order_relaxed);
  }
  beat_at_ns_.store(now, std::memory_order_relaxed);
}

void Watchdog::measure(std::int64_t silence_ns) noexcept {
  std::int64_t longest = longest_ns_.load(std::memory_order_relaxed);
  while (silence_ns > longest && !longest_ns_.compare_exchange_weak(longest, silence_ns, std::memory_order_relaxed)) {
  }
}

void Watchdog::watch(int priority) {
  if (priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = priority;
    ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameters);
  }
  std::int64_t reported = kResting;  // the last beat before the stall that was reported last
  const auto report = [&](std::int64_t since) {
    if (since <= reported) return;
    reported = since;
    stalls_.fetch_add(1, std::memory_order_relaxed);
    if (late_) late_();
  };
  while (!over_) {
    std::this_thread::sleep_for(patience_ / 4);
    report(stood_since_ns_.load(std::memory_order_relaxed));
    const std::int64_t last = beat_at_ns_.load(std::memory_order_relaxed);
    const std::int64_t silence = now_ns() - last;
    if (last == kResting || silence <= patience_.count()) continue;
    measure(silence);
    report(last);
  }
}

}  // namespace osteon
