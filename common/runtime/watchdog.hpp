// Watches a loop from another thread. Reports stalls, and counts and measures them.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>

namespace osteon {

class Watchdog {
 public:
  // `late` is called on the watchdog's own thread, once for each stall, as soon as no beat has come for `patience`. If
  // the watchdog itself stalled too, `late` is called after that. Watching begins with the first beat. `priority`: of
  // the watchdog's thread, above that of the loop. With 0, or if the machine refuses it, the priority is ordinary.
  Watchdog(std::chrono::nanoseconds patience, int priority, std::function<void()> late);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  // [loop] The loop is running.
  void beat() noexcept;
  // [loop] The loop is about to pause. Silence is not a stall until the next beat.
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
  // Time of the last beat, and of the last beat before a stall that has ended (on the steady clock).
  std::atomic<std::int64_t> beat_at_ns_{kResting}, stood_since_ns_{kResting};
  std::atomic<std::uint64_t> stalls_{0};
  std::atomic<std::int64_t> longest_ns_{0};
  std::atomic<bool> over_{false};
  std::thread thread_;
};

}  // namespace osteon
