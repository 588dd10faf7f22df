// Remembers which refusals were logged: once for each peer and reason, so that endless attempts of one caller cannot
// fill the disk. See refusals.hpp.
#pragma once
#include <cstddef>
#include <deque>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace osteon {

// Not thread safe. Remembers the newest kMost refusals; an older one counts as new again.
class RefusalLog {
 public:
  static constexpr std::size_t kMost = 1024;
  // Returns true the first time.
  [[nodiscard]] bool is_new(std::string_view peer, std::string_view reason) {
    std::pair<std::string, std::string> seen(peer.substr(0, kMostChars), reason.substr(0, kMostChars));
    if (!known_.insert(seen).second) return false;
    order_.push_back(std::move(seen));
    if (order_.size() > kMost) {
      known_.erase(order_.front());
      order_.pop_front();
    }
    return true;
  }
  [[nodiscard]] std::size_t size() const { return order_.size(); }

 private:
  static constexpr std::size_t kMostChars = 128;
  std::set<std::pair<std::string, std::string>> known_;
  std::deque<std::pair<std::string, std::string>> order_;
};

}  // namespace osteon
