// A stream of messages between a client and a server on virtual time, like gRPC over TCP. It is reliable and in order
// until it breaks. It is late where the network loses. Data in transit is bounded.
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
  double loss = 0;                                                // of segments: they come later, but they come
};

// The network between one client and the server, in both directions.
class SimPath {
 public:
  using Time = VirtualTime::Time;
  // of TCP: a segment that has not arrived by then never will
  static constexpr Time kPatience = std::chrono::seconds(10);

  SimPath(VirtualTime& time, std::uint64_t seed, const PathCondition& condition)
      : time_(time), random_(seed), condition_(condition) {}
  void set(const PathCondition& condition) { condition_ = condition; }
  void partition(Time from, Time until) { partitions_.emplace_back(from, until); }
  void heal();  // ends all partitions
  // Arrival time of data sent now. It is sent again after 200, 400, 800 ms... until it gets through. Nothing: it never
  // does.
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

// Uniformly drawn times.
[[nodiscard]] inline VirtualTime::Time drawn(Random& random, VirtualTime::Time low, VirtualTime::Time high) {
  return low + VirtualTime::Time(static_cast<std::int64_t>(random.unit() * static_cast<double>((high - low).count())));
}

// How a stream ended.
struct Ending {
  bool stands = false;  // reported by the server itself: a retry would change nothing
  std::string why;
};

class SimStream : public std::enable_shared_from_this<SimStream> {
 public:
  using Time = VirtualTime::Time;
  enum End { client = 0, server = 1 };
  // Callbacks of an end, never called from within its own calls. `ended` is called once and last. The server gets it
  // also when the client has gone.
  struct Hears {
    std::function<void(std::string)> message;
    std::function<void()> writable;
    std::function<void(const Ending&)> ended;
  };

  SimStream(SimPath& path, std::size_t window_bytes) : path_(path), window_bytes_(window_bytes) {}
  void listen(End end, Hears hears) { ends_[end].hears = std::move(hears); }
  // Whether a message may be sent: data in transit is less than the window.
  [[nodiscard]] bool writable(End from) const { return !over_ && ends_[from].under_way < window_bytes_; }
  void write(End from, std::string message);
  // Messages to this end wait, and fill the window, until it reads again.
  void stop_reading(End end) { ends_[end].reads = false; }
  void read_on(End end);
  // [server] Ends the stream after all that was written. The server's end gets no more callbacks.
  void finish(const Ending& ending);
  // The end leaves at once. Written messages may still arrive. The other end learns of it some time later.
  void leave(End end);
  // The connection breaks in the middle.
  void break_off(const std::string& why);

  [[nodiscard]] bool open() const { return !over_; }
  // The time at which all that was written so far has arrived, as far as it does.
  [[nodiscard]] Time delayed_until() const { return std::max(ends_[client].last, ends_[server].last); }
  // Open, with nothing in transit. After its end, an end may not know of it yet.
  [[nodiscard]] bool at_rest() const { return !over_ && ends_[client].under_way == 0 && ends_[server].under_way == 0; }
  [[nodiscard]] static std::uint64_t broken() { return broken_; }  // streams broken in this process

 private:
  struct Side {
    Hears hears;
    std::size_t under_way = 0;       // bytes in transit from this end
    Time last{};                     // arrival, at the other end, of the newest message from this end
    Time lost_from = Time::max();    // messages that would arrive at this end later are lost
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
  bool over_ = false;  // nothing is written any more
  inline static std::uint64_t broken_ = 0;
};

}  // namespace osteon::test
