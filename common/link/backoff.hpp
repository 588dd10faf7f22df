// How long to wait before trying again to reach a server.
#pragma once
#include <chrono>
#include <cstdint>
#include <random>

namespace osteon {

struct BackoffBounds {
  std::chrono::nanoseconds least = std::chrono::milliseconds{100};
  std::chrono::nanoseconds most = std::chrono::seconds{5};
};

// Evenly between `least` and a limit that doubles with each failure, from twice `least` up to `most`: clients that lost
// a server at the same moment do not come back at the same moment.
class Backoff {
 public:
  explicit Backoff(std::uint64_t seed, const BackoffBounds& bounds = {});
  // After a failure: how long to wait.
  [[nodiscard]] std::chrono::nanoseconds next();
  // After a success: the next failure is a first one.
  void reset() { limit_ = bounds_.least; }

 private:
  const BackoffBounds bounds_;
  std::chrono::nanoseconds limit_;
  std::mt19937_64 random_;
};

}  // namespace osteon
