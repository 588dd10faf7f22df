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
  // `late` is called on the watchdog's own thread, once for each stall, as soon as no beat has come for `patience`, or
  // after it, where the watchdog stood as well; the watch begins with the first beat. `priority`: of that thread, above
  // the loop's; 0 or what the machine refuses: ordinary.
  Watchdog(std::chrono::nanoseconds patience, int priority, std::function<void()> late);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  // [loop] The loop runs.
  void beat() noexcept;
  // [loop] The loop means to stop: silence is no stall from here on, until it beats again.
  void rest() noexcept { beat_at_ns_.store(kResting, std::memory_order_relaxed); }
  // Any thread.
  [[nodiscard]] std::uint64_t stalls() const noexcept { return stalls_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::chrono::nanoseconds longest() const noexcept {
    return std::chrono::nanoseconds(longest_ns_.load(std::memory_order_relaxed));
  }

 private:
  static constexpr std::int64_t kResting = 0;

  void watch(int priority);
  void measure(std::int64_t silence_ns) noexcept;

  const std::chrono::nanoseconds patience_;
  const std::function<void()> late_;
  // When the last beat came; when the last one came before a stall that is over (on the steady clock).
  std::atomic<std::int64_t> beat_at_ns_{kResting}, stood_since_ns_{kResting};
  std::atomic<std::uint64_t> stalls_{0};
  std::atomic<std::int64_t> longest_ns_{0};
  std::atomic<bool> over_{false};
  std::thread thread_;
};

}  // namespace osteon
