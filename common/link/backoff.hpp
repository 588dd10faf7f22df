// How long a client waits before it tries again to reach a server.
#pragma once
#include <chrono>
#include <cstdint>
#include <random>

namespace osteon {

struct BackoffBounds {
  std::chrono::nanoseconds least = std::chrono::milliseconds{100};
  std::chrono::nanoseconds most = std::chrono::seconds{5};
};

// Waits are random and uniform between `least` and a limit. The limit starts at twice `least` and doubles with each
// failure, up to `most`. So clients that lost a server at the same moment do not all return at the same moment.
class Backoff {
 public:
  explicit Backoff(std::uint64_t seed, const BackoffBounds& bounds = {});
  // Called after a failure. Returns how long to wait.
  [[nodiscard]] std::chrono::nanoseconds next();
  // Called after a success. The next failure counts as the first.
  void reset() { limit_ = bounds_.least; }

 private:
  const BackoffBounds bounds_;
  std::chrono::nanoseconds limit_;
  std::mt19937_64 random_;
};

}  // namespace osteon
