// Decides which refusals are logged: once for each peer and reason, and only so many in a time. So endless attempts of
// a caller, even from new addresses, cannot fill the disk. See refusals.hpp.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
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
  static constexpr double kLinesAtOnce = 256.0, kLinesPerSecond = 1.0;
  using Time = std::chrono::steady_clock::time_point;
  // Returns true the first time, unless the limit of lines is reached.
  [[nodiscard]] bool is_new(std::string_view peer, std::string_view reason,
                            Time now = std::chrono::steady_clock::now()) {
    std::pair<std::string, std::string> seen(peer.substr(0, kMostChars), reason.substr(0, kMostChars));
    if (!known_.insert(seen).second) return false;
    order_.push_back(std::move(seen));
    if (order_.size() > kMost) {
      known_.erase(order_.front());
      order_.pop_front();
    }
    lines_ = std::min(kLinesAtOnce, lines_ + kLinesPerSecond * std::chrono::duration<double>(now - at_).count());
    at_ = now;
    if (lines_ < 1.0) {
      ++left_out_;
      return false;
    }
    lines_ -= 1.0;
    return true;
  }
  // How many new ones had no place since the last time that this was asked.
  [[nodiscard]] std::uint64_t take_left_out() { return std::exchange(left_out_, 0); }
  [[nodiscard]] std::size_t size() const { return order_.size(); }

 private:
  static constexpr std::size_t kMostChars = 128;
  std::set<std::pair<std::string, std::string>> known_;
  std::deque<std::pair<std::string, std::string>> order_;
  double lines_ = kLinesAtOnce;
  Time at_{};
  std::uint64_t left_out_ = 0;
};

}  // namespace osteon
