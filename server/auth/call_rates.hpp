// Limits how often one person may make a call. The limits lie above what anybody does by hand, and below what would
// fill a journal or the queues of a room.
#pragma once
#include <chrono>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace osteon {

struct CallRate {
  double per_second = 0.0;
  double at_once = 0.0;  // calls at once after a pause
};

// The limit of a method, by its full name. Null: no limit, as for calls that change nothing and cost little.
[[nodiscard]] const CallRate* find_call_rate(std::string_view method);

// A bucket for each person and call. Not thread safe.
class CallRates {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::size_t kMost = 8192;  // largest number of buckets; full buckets are removed first
  // Returns true if one more call is allowed.
  [[nodiscard]] bool take(std::string_view user, std::string_view method, Time now);
  [[nodiscard]] std::size_t size() const { return buckets_.size(); }

 private:
  struct Bucket {
    double left = 0.0;
    Time when{};
    const CallRate* rate = nullptr;
    [[nodiscard]] double left_at(Time now) const;
  };
  void make_space(Time now);
  std::map<std::pair<std::string, std::string>, Bucket> buckets_;
};

}  // namespace osteon
