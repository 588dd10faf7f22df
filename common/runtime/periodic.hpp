// Wakes a thread at a fixed rate on the monotonic clock. Due times are absolute, so that lateness does not accumulate.
#pragma once
#include <algorithm>
#include <chrono>

#include "common/runtime/tick_stats.hpp"

namespace osteon {

using SteadyTime = std::chrono::steady_clock::time_point;

// How long before a due time a thread wakes up, to spin until then. The kernel wakes a sleeper late, by an amount that
// depends on the machine and on what it does. So the margin follows the lateness: it rises at once, and falls slowly.
class WakeUpMargin {
 public:
  explicit WakeUpMargin(std::chrono::nanoseconds most) noexcept : most_(most), value_(most) {}
  void woke(std::chrono::nanoseconds late) noexcept {
    constexpr double kKept = 0.999;  // per sleep: at 1 kHz, half of it is forgotten in 0.7 s
    value_ = std::clamp(Exact(1.25 * late), kKept * value_, Exact(most_));
  }
  [[nodiscard]] std::chrono::nanoseconds value() const noexcept {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(value_);
  }

 private:
  using Exact = std::chrono::duration<double, std::nano>;
  std::chrono::nanoseconds most_;
  Exact value_;  // a quarter more than the lateness
};

class PeriodicTimer {
 public:
  // `most_spin`: sleep until at most this long before the due time, then spin. This makes a 1 kHz wake-up precise. The
  // timer spins no longer than this machine needs, because a spinning thread occupies a core.
  explicit PeriodicTimer(std::chrono::nanoseconds period, std::chrono::nanoseconds most_spin = {});
  // Sleeps until the next due time and records lateness and misses. After a miss the due times move on, so that no
  // burst follows a long stall. Returns how many periods have passed, 1 when on time.
  int wait(TickStats& stats) noexcept;
  // Records the work since the last wait() returned.
  void done(TickStats& stats) noexcept;
  [[nodiscard]] SteadyTime woke() const noexcept { return woke_; }

 private:
  std::chrono::nanoseconds period_;
  WakeUpMargin margin_;
  SteadyTime due_, woke_;
};

// make_realtime() (realtime.hpp). False if the machine refuses the priority or refuses to lock memory.
bool try_realtime(int priority) noexcept;

}  // namespace osteon
