#include "common/runtime/periodic.hpp"

#include <sys/prctl.h>
#include <time.h>

#include "common/runtime/realtime.hpp"

namespace osteon {

PeriodicTimer::PeriodicTimer(std::chrono::nanoseconds period, std::chrono::nanoseconds spin)
    : period_(period), spin_(spin), due_(std::chrono::steady_clock::now() + period), woke_(due_ - period) {
  ::prctl(PR_SET_TIMERSLACK, 1UL);
}

int PeriodicTimer::wait(TickStats& stats) noexcept {
  const auto sleep_until = (due_ - spin_).time_since_epoch();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(sleep_until);
  const timespec when{static_cast<time_t>(seconds.count()),
                      static_cast<long>(std::chrono::nanoseconds(sleep_until - seconds).count())};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) != 0) {
  }
  do woke_ = std::chrono::steady_clock::now();
  while (woke_ < due_);

  const auto late = woke_ - due_;
  stats.lateness.record(late);
  const auto periods = 1 + late / period_;
  if (periods > 1) stats.missed += static_cast<std::uint64_t>(periods - 1);
  due_ += periods * period_;
  return static_cast<int>(periods);
}

void PeriodicTimer::done(TickStats& stats) noexcept { stats.work.record(std::chrono::steady_clock::now() - woke_); }

bool try_realtime(int priority) noexcept {
  const Realtime got = make_realtime(priority);
  return got.fifo && got.locked;
}

}  // namespace osteon
