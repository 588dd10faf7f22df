// Waking at a fixed rate on the monotonic clock, against absolute due times, so that lateness does not accumulate.
#pragma once
#include <chrono>

#include "common/runtime/tick_stats.hpp"

namespace osteon {

using SteadyTime = std::chrono::steady_clock::time_point;

class PeriodicTimer {
 public:
  // `spin`: sleep until this long before the due time, then spin; makes a 1 kHz wake-up precise at the price of a core.
  explicit PeriodicTimer(std::chrono::nanoseconds period, std::chrono::nanoseconds spin = {});
  // Sleeps until the next due time; records lateness and misses. After a miss the due times move on, so a long stall
  // is not followed by a burst. Returns how many periods have passed, 1 when on time.
  int wait(TickStats& stats) noexcept;
  // Records the work since the last wait() returned.
  void done(TickStats& stats) noexcept;
  [[nodiscard]] SteadyTime woke() const noexcept { return woke_; }

 private:
  std::chrono::nanoseconds period_, spin_;
  SteadyTime due_, woke_;
};

// make_realtime() (realtime.hpp); false where the machine refuses the priority or to lock memory.
bool try_realtime(int priority) noexcept;

}  // namespace osteon
