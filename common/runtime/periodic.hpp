// Wakes a thread at a fixed rate on the monotonic clock. Due times are absolute, so that lateness does not accumulate.
#pragma once
#include <chrono>

#include "common/runtime/tick_stats.hpp"

namespace osteon {

using SteadyTime = std::chrono::steady_clock::time_point;

class PeriodicTimer {
 public:
  // `spin`: sleep until this long before the due time, then spin. This makes a 1 kHz wake-up precise, but occupies a
  // core.
  explicit PeriodicTimer(std::chrono::nanoseconds period, std::chrono::nanoseconds spin = {});
  // Sleeps until the next due time and records lateness and misses. After a miss the due times move on, so that no
  // burst follows a long stall. Returns how many periods have passed, 1 when on time.
  int wait(TickStats& stats) noexcept;
  // Records the work since the last wait() returned.
  void done(TickStats& stats) noexcept;
  [[nodiscard]] SteadyTime woke() const noexcept { return woke_; }

 private:
  std::chrono::nanoseconds period_, spin_;
  SteadyTime due_, woke_;
};

// make_realtime() (realtime.hpp). False if the machine refuses the priority or refuses to lock memory.
bool try_realtime(int priority) noexcept;

}  // namespace osteon
