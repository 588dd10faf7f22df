// Durations of a loop as a histogram: recording allocates nothing, percentiles are right to 3 %.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>

namespace osteon {

class DurationHistogram {
 public:
  void record(std::chrono::nanoseconds duration) noexcept;  // negative counts as zero
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] double percentile_us(double percent) const noexcept;  // 0 when empty
  // Those of at most that long; one that is up to 3 % longer may count too.
  [[nodiscard]] std::uint64_t count_up_to(std::chrono::nanoseconds duration) const noexcept;
  [[nodiscard]] double sum_us() const noexcept { return static_cast<double>(sum_ns_) / 1000.0; }
  // What was recorded after an earlier copy of this; its largest is of all.
  [[nodiscard]] DurationHistogram since(const DurationHistogram& earlier) const noexcept;
  [[nodiscard]] double max_us() const noexcept { return static_cast<double>(max_ns_) / 1000.0; }

 private:
  // Bins: 32 for each power of two of nanoseconds.
  static constexpr int kSubBits = 5;
  static constexpr int kBins = 44 << kSubBits;
  std::array<std::uint32_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0, sum_ns_ = 0;
};

// What a periodic loop says of itself.
struct TickStats {
  DurationHistogram lateness;  // start of the tick after its due time
  DurationHistogram work;      // from start to end of the tick
  std::uint64_t missed = 0;    // periods that no tick ran in, because the one before came too late
  [[nodiscard]] TickStats since(const TickStats& earlier) const noexcept {
    return {lateness.since(earlier.lateness), work.since(earlier.work), missed - earlier.missed};
  }
};

}  // namespace osteon
