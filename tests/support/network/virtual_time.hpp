// A clock that moves only on request, with actions posted for its times. It is the only loop of a simulation.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace osteon::test {

class VirtualTime {
 public:
  using Time = std::chrono::nanoseconds;  // since the start of the simulation

  [[nodiscard]] Time now() const { return now_; }
  // Runs the action at that time, in the order of posting. At once (in the next run) if the time is in the past.
  void post(Time at, std::function<void()> action);
  void post_in(Time later, std::function<void()> action) { post(now_ + later, std::move(action)); }
  // Runs the next action and moves the clock to its time. False: there is none.
  bool run_next();
  // Runs all actions up to `until`, including those that they post. Then the clock is at `until`.
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
