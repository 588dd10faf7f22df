// Open streams as the parts of a room see them: subscribers, free of gRPC.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

namespace osteon {

// What a room sends to an open stream. Each part of the room calls it under its own lock, so it must return at once and
// never call back.
class Subscriber {
 public:
  virtual ~Subscriber() = default;
  virtual void end(const std::string& why) = 0;           // the server stops
  [[nodiscard]] virtual std::size_t waiting() const = 0;  // entries or blocks that the reader is behind
};

// Says when something is due that happens at a given average interval. The first time, and after a pause, it is due at
// once.
class Pace {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr int kTurns = 4;
  explicit Pace(std::chrono::nanoseconds apart) : apart_(apart) {}
  // For the `number`th of many that begin together and are asked kTurns times in `apart`: they take turns. The due
  // times lie in the middle between two questions, so that the times of the questions need not be exact.
  Pace(std::chrono::nanoseconds apart, std::size_t number) : apart_(apart) {
    constexpr std::array<int, kTurns> kOrder{0, 2, 1, 3};
    early_ = apart * (2 * kOrder[number % kTurns] + 1) / (2 * kTurns);
  }
  [[nodiscard]] bool due(Time now) const { return now >= next_; }
  // The due times are steps from the first time on. One late step does not delay those after it.
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
  // Returns false if it was not in the list.
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
