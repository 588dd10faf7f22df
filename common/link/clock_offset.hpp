// What another machine's clock shows, from the times at which datagrams went to it and came back.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <optional>

namespace osteon {

// One datagram there and one back; each time on the clock of the machine where it was taken.
struct ClockSample {
  std::chrono::nanoseconds sent{};           // here
  std::chrono::nanoseconds peer_received{};  // there
  std::chrono::nanoseconds peer_sent{};      // there
  std::chrono::nanoseconds received{};       // here
};

struct ClockReading {
  std::chrono::nanoseconds offset{};      // the peer's clock minus this one's
  std::chrono::nanoseconds round_trip{};  // without the time that the peer kept it
  // The true offset at the time of the sample is within `error` of this one: it is off by half the difference of the
  // two ways, and neither way takes less than no time.
  std::chrono::nanoseconds error{};
};

// After RFC 5905, sections 8 and 10: offset ((t2 - t1) + (t3 - t4)) / 2, and among the latest samples the one of the
// least round trip, for what a queue adds to one way it takes for a difference of the clocks. Clocks drift by up to 0.1
// ms a second, hence the age limit. For showing and measuring only: nothing that must be right may be decided by it.
// One thread.
class ClockOffset {
 public:
  static constexpr std::size_t kSamples = 16;
  static constexpr std::chrono::nanoseconds kMostAge = std::chrono::seconds{30};

  // False when no clocks and no network can have made it, as where a peer writes what it likes.
  bool add(const ClockSample& sample) noexcept;
  // The best of those not too old at `now`, on this machine's clock; nothing when there is none.
  [[nodiscard]] std::optional<ClockReading> at(std::chrono::nanoseconds now) const noexcept;

 private:
  struct Kept {
    ClockReading reading;
    std::chrono::nanoseconds received{};
  };
  std::array<Kept, kSamples> kept_{};
  std::size_t count_ = 0;  // ever added; the next goes to count_ mod kSamples
};

}  // namespace osteon
