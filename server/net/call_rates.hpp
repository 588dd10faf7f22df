// How often one person may make a call: more often than anybody does by hand, and less than what would fill a journal
// or the queues of a room.
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
  double at_once = 0.0;  // after a pause
};

// What holds for a method, by its full name; null: as often as one likes, as for what changes nothing and costs little.
[[nodiscard]] const CallRate* find_call_rate(std::string_view method);

// A bucket for each person and call. Not thread safe.
class CallRates {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::size_t kMost = 8192;  // buckets; those that are full again go first
  // True: once more.
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
