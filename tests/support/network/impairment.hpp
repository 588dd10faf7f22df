// The effects of a bad path on datagrams, decided by a seed. A simulated network and the relay between real sockets use
// it. Pure: time is a parameter.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "tests/support/scenes/random.hpp"

namespace osteon::test {

// One direction of a path. Shares are of datagrams, 0 to 1, each drawn independently.
struct PathQuality {
  double loss = 0;
  double duplicate = 0;               // arrive a second time, up to `reorder_by` later
  double reorder = 0;                 // are held back, so that later ones overtake them
  double corrupt = 0;                 // arrive with 1 to 3 bits flipped
  std::chrono::nanoseconds delay{};   // one way
  std::chrono::nanoseconds jitter{};  // delay is between delay - jitter and delay + jitter; keeps the order
  std::chrono::nanoseconds reorder_by = std::chrono::milliseconds(30);  // longest time that one is held back
  double bytes_per_s = 0;                                               // 0: no limit
  std::size_t queue_bytes = 64 * 1024;                                  // waiting at the limit; more than that is lost
};

struct ImpairmentCounts {
  std::uint64_t given = 0, lost = 0, overflowed = 0, duplicated = 0, held_back = 0, corrupted = 0;
};

class Impairment {
 public:
  using Time = std::chrono::nanoseconds;

  explicit Impairment(std::uint64_t seed) : random_(seed), flips_(seed) {}
  void set(const PathQuality& quality) { quality_ = quality; }
  [[nodiscard]] const PathQuality& quality() const { return quality_; }

  struct Copy {
    Time at;       // of arrival
    bool spoiled;  // apply spoil() to it
  };
  // The fate of a datagram given now: none, one or two copies.
  [[nodiscard]] std::vector<Copy> pass(Time now, std::size_t bytes);
  void spoil(std::span<std::uint8_t> bytes);
  [[nodiscard]] const ImpairmentCounts& counts() const { return counts_; }

 private:
  [[nodiscard]] Time up_to(Time most) {
    return Time(static_cast<std::int64_t>(random_.unit() * static_cast<double>(most.count())));
  }

  PathQuality quality_;
  Random random_, flips_;
  Time busy_until_{};    // the limited link sends until then
  Time last_arrival_{};  // of those that keep the order
  ImpairmentCounts counts_;
};

}  // namespace osteon::test
