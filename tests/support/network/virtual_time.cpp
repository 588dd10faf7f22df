#include "tests/support/network/virtual_time.hpp"

#include <algorithm>

namespace osteon::test {

void VirtualTime::post(Time at, std::function<void()> action) {
  events_.push_back({std::max(at, now_), order_++, std::move(action)});
  std::ranges::push_heap(events_, later);
}

bool VirtualTime::run_next() {
  if (events_.empty()) return false;
  std::ranges::pop_heap(events_, later);
  const Event event = std::move(events_.back());
  events_.pop_back();
  now_ = event.at;
  event.action();
  return true;
}

void VirtualTime::run_until(Time until) {
  while (!events_.empty() && events_.front().at <= until) run_next();
  now_ = std::max(now_, until);
}

}  // namespace osteon::test
