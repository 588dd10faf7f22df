#include "common/link/clock_offset.hpp"

#include <algorithm>

namespace osteon {
namespace {

// About 36 years: longer than any clock has run, and small enough that sums of two differences do not overflow.
constexpr std::chrono::nanoseconds kFarthest{std::int64_t{1} << 60};

bool near(std::chrono::nanoseconds time) { return time > -kFarthest && time < kFarthest; }

}  // namespace

bool ClockOffset::add(const ClockSample& sample) noexcept {
  if (!near(sample.sent) || !near(sample.peer_received) || !near(sample.peer_sent) || !near(sample.received))
    return false;
  const auto away = sample.received - sample.sent, kept = sample.peer_sent - sample.peer_received;
  if (kept < std::chrono::nanoseconds{0} || away < kept) return false;
  const auto there = sample.peer_received - sample.sent, back = sample.peer_sent - sample.received;
  const auto round_trip = away - kept;
  // Halves are rounded down, by less than the nanosecond that is added to the error.
  const auto error = (round_trip + std::chrono::nanoseconds{1}) / 2;
  kept_[count_++ % kSamples] = {{(there + back) / 2, round_trip, error}, sample.received};
  return true;
}

std::optional<ClockReading> ClockOffset::at(std::chrono::nanoseconds now) const noexcept {
  std::optional<ClockReading> best;
  for (std::size_t i = 0; i < std::min(count_, kSamples); ++i) {
    if (now - kept_[i].received > kMostAge) continue;
    if (!best || kept_[i].reading.round_trip < best->round_trip) best = kept_[i].reading;
  }
  return best;
}

}  // namespace osteon
