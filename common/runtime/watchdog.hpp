// Looks after a loop from another thread: says when it has not run for a while, how often and how long that was.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>

namespace osteon {

class Watchdog {
 public:
  // `late` is called on the watchdog's own thread, once for each stall, as soon as no beat has come for `patience`; the
  // watch begins with the first beat. `priority`: of that thread, above the loop's; 0 or what the machine refuses: ordinary.
  Watchdog(std::chrono::nanoseconds patience, int priority, std::function<void()> late);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  // [loop] The loop runs.
  void beat() noexcept { beats_.fetch_add(1, std::memory_order_relaxed); }
  // [loop] The loop means to stop: silence is no stall from here on, until it beats again.
  void rest() noexcept { resting_.store(beats_.load(std::memory_order_relaxed), std::memory_order_relaxed); }
  // Any thread.
  [[nodiscard]] std::uint64_t stalls() const noexcept { return stalls_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::chrono::nanoseconds longest() const noexcept {
    return std::chrono::nanoseconds(longest_ns_.load(std::memory_order_relaxed));
  }

 private:
  void watch(int priority);

  const std::chrono::nanoseconds patience_;
  const std::function<void()> late_;
  std::atomic<std::uint64_t> beats_{0}, resting_{0};  // rests while they are equal
  std::atomic<std::uint64_t> stalls_{0};
  std::atomic<std::int64_t> longest_ns_{0};
  std::atomic<bool> over_{false};
  std::thread thread_;
};

}  // namespace osteon
