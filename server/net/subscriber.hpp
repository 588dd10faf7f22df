// Open streams as the parts of a room see them: subscribers, free of gRPC.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

namespace osteon {

// What a room says to an open stream. Called under a lock of the part that says it: must return at once and never call
// back.
class Subscriber {
 public:
  virtual ~Subscriber() = default;
  virtual void end(const std::string& why) = 0;           // the server stops
  [[nodiscard]] virtual std::size_t waiting() const = 0;  // entries or blocks that the reader is behind
};

// When something may be done that is done so far apart on average, the first time and after a pause at once.
class Pace {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr int kTurns = 4;
  explicit Pace(std::chrono::nanoseconds apart) : apart_(apart) {}
  // The `number`th of many that begin together and are asked kTurns times in `apart`: they take turns. Its steps lie in
  // the middle between two times of asking, so that none of these has to be exact.
  Pace(std::chrono::nanoseconds apart, std::size_t number) : apart_(apart) {
    constexpr std::array<int, kTurns> kOrder{0, 2, 1, 3};
    early_ = apart * (2 * kOrder[number % kTurns] + 1) / (2 * kTurns);
  }
  [[nodiscard]] bool due(Time now) const { return now >= next_; }
  // In steps from the first time on: one that comes late does not put off those after it.
  void done(Time now) {
    next_ += apart_;
    if (next_ < now) next_ = now + apart_ - early_;
  }

 private:
  std::chrono::nanoseconds apart_, early_{};
  Time next_{};
};

// The open streams of one kind.
template <class Receiver>
class Subscribers {
 public:
  void add(Receiver& subscriber) { subscribers_.push_back(&subscriber); }
  // False: it was not among them.
  bool remove(Receiver& subscriber) { return std::erase(subscribers_, &subscriber) > 0; }
  template <class Call>
  void each(Call call) const {
    for (Receiver* subscriber : subscribers_) call(*subscriber);
  }
  [[nodiscard]] std::size_t size() const { return subscribers_.size(); }

 private:
  std::vector<Receiver*> subscribers_;
};

}  // namespace osteon
