// Estimates another machine's clock from the times of datagrams that went there and back.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <optional>

namespace osteon {

// One datagram there and one back. Each time is on the clock of the machine that took it.
struct ClockSample {
  std::chrono::nanoseconds sent{};           // here
  std::chrono::nanoseconds peer_received{};  // there
  std::chrono::nanoseconds peer_sent{};      // there
  std::chrono::nanoseconds received{};       // here
};

struct ClockReading {
  std::chrono::nanoseconds offset{};      // the peer's clock minus this one's
  std::chrono::nanoseconds round_trip{};  // without the time that the peer held it
  // The true offset at the time of the sample is within `error` of `offset`. The estimate is wrong by half the
  // difference of the two transit times, and no transit time is negative.
  std::chrono::nanoseconds error{};
};

// Follows RFC 5905, sections 8 and 10: offset ((t2 - t1) + (t3 - t4)) / 2. Of the latest samples it uses the one with
// the shortest round trip, because a queue in one direction looks like a clock difference. Clocks drift by up to 0.1 ms
// a second, hence the age limit. Use it only to display and measure. No decision that must be correct may depend on it.
// One thread.
class ClockOffset {
 public:
  static constexpr std::size_t kSamples = 16;
  static constexpr std::chrono::nanoseconds kMostAge = std::chrono::seconds{30};

  // False for a sample that no clocks and no network can produce, such as values that a peer has invented.
  bool add(const ClockSample& sample) noexcept;
  // The best sample that is not too old at `now`, on this machine's clock. Nothing if there is none.
  [[nodiscard]] std::optional<ClockReading> at(std::chrono::nanoseconds now) const noexcept;

 private:
  struct Kept {
    ClockReading reading;
    std::chrono::nanoseconds received{};
  };
  std::array<Kept, kSamples> kept_{};
  std::size_t count_ = 0;  // samples ever added; the next one goes to count_ mod kSamples
};

}  // namespace osteon
