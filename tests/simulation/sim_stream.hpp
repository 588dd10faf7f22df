// A stream of messages between a client and a server on virtual time, as gRPC over TCP would carry it: reliable and in
// order until it breaks, late where the network loses, and with a bound on what is under way.
#pragma once
#include <algorithm>
#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/network/virtual_time.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon::test {

struct PathCondition {
  std::chrono::nanoseconds delay = std::chrono::milliseconds(1);  // one way
  std::chrono::nanoseconds jitter{};                              // delay is between delay - jitter and delay + jitter
  double loss = 0;                                                // of segments: they come later, not never
};

// The network between one client and the server, in both directions.
class SimPath {
 public:
  using Time = VirtualTime::Time;
  static constexpr Time kPatience = std::chrono::seconds(10);  // of TCP: a segment that has not come by then never will

  SimPath(VirtualTime& time, std::uint64_t seed, const PathCondition& condition)
      : time_(time), random_(seed), condition_(condition) {}
  void set(const PathCondition& condition) { condition_ = condition; }
  void partition(Time from, Time until) { partitions_.emplace_back(from, until); }
  void heal();  // no partition from now on
  // When something sent now is there, sent again after 200, 400, 800 ms... until it comes through. Nothing: it does
  // not.
  [[nodiscard]] std::optional<Time> arrival();
  [[nodiscard]] Time delay() const { return condition_.delay; }
  [[nodiscard]] Random& random() { return random_; }
  [[nodiscard]] VirtualTime& time() { return time_; }

 private:
  [[nodiscard]] bool cut_off(Time at) const;

  VirtualTime& time_;
  Random random_;
  PathCondition condition_;
  std::vector<std::pair<Time, Time>> partitions_;
};

// Evenly drawn times.
[[nodiscard]] inline VirtualTime::Time drawn(Random& random, VirtualTime::Time low, VirtualTime::Time high) {
  return low + VirtualTime::Time(static_cast<std::int64_t>(random.unit() * static_cast<double>((high - low).count())));
}

// How a stream ended.
struct Ending {
  bool stands = false;  // said by the server itself: trying again would change nothing
  std::string why;
};

class SimStream : public std::enable_shared_from_this<SimStream> {
 public:
  using Time = VirtualTime::Time;
  enum End { client = 0, server = 1 };
  // What an end hears, never from within its own calls. `ended` comes once and last; to the server also when the client
  // has gone.
  struct Hears {
    std::function<void(std::string)> message;
    std::function<void()> writable;
    std::function<void(const Ending&)> ended;
  };

  SimStream(SimPath& path, std::size_t window_bytes) : path_(path), window_bytes_(window_bytes) {}
  void listen(End end, Hears hears) { ends_[end].hears = std::move(hears); }
  // A message may go: less than the window is under way.
  [[nodiscard]] bool writable(End from) const { return !over_ && ends_[from].under_way < window_bytes_; }
  void write(End from, std::string message);
  // Messages to this end wait, and fill the window, until it reads on.
  void stop_reading(End end) { ends_[end].reads = false; }
  void read_on(End end);
  // [server] After all that was written. The server's end hears nothing more.
  void finish(const Ending& ending);
  // The end goes away at once: what was written may arrive still, and the other end finds out some time.
  void leave(End end);
  // The connection breaks in the middle.
  void break_off(const std::string& why);

  [[nodiscard]] bool open() const { return !over_; }
  // When all that was written so far has arrived, as far as it does.
  [[nodiscard]] Time delayed_until() const { return std::max(ends_[client].last, ends_[server].last); }
  // Open, with nothing under way; once it is over, an end may not know it yet.
  [[nodiscard]] bool at_rest() const { return !over_ && ends_[client].under_way == 0 && ends_[server].under_way == 0; }
  [[nodiscard]] static std::uint64_t broken() { return broken_; }  // so many were, in this process

 private:
  struct Side {
    Hears hears;
    std::size_t under_way = 0;       // bytes from this end
    Time last{};                     // arrival, at the other end, of the newest message from this end
    Time lost_from = Time::max();    // what would come to this end later does not
    std::deque<std::string> unread;  // at this end
    bool reads = true, told = false;
  };
  static End other(End end) { return end == client ? server : client; }
  void arrive(End to, std::string message);
  void pass_on(End to);
  void tell_ended(End end, Time at, const Ending& ending);
  void lose(const std::string& why);

  SimPath& path_;
  const std::size_t window_bytes_;
  std::array<Side, 2> ends_;
  bool over_ = false;  // nobody writes any more
  inline static std::uint64_t broken_ = 0;
};

}  // namespace osteon::test
