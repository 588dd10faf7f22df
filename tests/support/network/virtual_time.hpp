// A clock that only moves when told to, and what is to happen at its times: the one loop of a simulation.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace osteon::test {

class VirtualTime {
 public:
  using Time = std::chrono::nanoseconds;  // since the simulation's start

  [[nodiscard]] Time now() const { return now_; }
  // Runs at that time, what was posted first going first; at once (in the next run) for a time that has passed.
  void post(Time at, std::function<void()> action);
  void post_in(Time later, std::function<void()> action) { post(now_ + later, std::move(action)); }
  // The next of what is posted, and the clock with it; false when nothing is.
  bool run_next();
  // All that is posted up to `until`, with what that posts; the clock stands at `until` afterwards.
  void run_until(Time until);
  [[nodiscard]] std::size_t posted() const { return events_.size(); }
  [[nodiscard]] std::optional<Time> next_at() const {
    return events_.empty() ? std::nullopt : std::optional(events_.front().at);
  }

 private:
  struct Event {
    Time at;
    std::uint64_t order;
    std::function<void()> action;
  };
  static bool later(const Event& a, const Event& b) { return a.at != b.at ? a.at > b.at : a.order > b.order; }

  Time now_{};
  std::uint64_t order_ = 0;
  std::vector<Event> events_;  // heap, the next one first
};

}  // namespace osteon::test
