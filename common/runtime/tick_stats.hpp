// Durations of a loop as a histogram. Recording allocates nothing. Percentiles are correct to 3 %.
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
  // Number of durations of at most this length. A duration up to 3 % longer may be counted too.
  [[nodiscard]] std::uint64_t count_up_to(std::chrono::nanoseconds duration) const noexcept;
  [[nodiscard]] double sum_us() const noexcept { return static_cast<double>(sum_ns_) / 1000.0; }
  // What was recorded after `earlier`, an older copy of this. Its largest value is that of all time.
  [[nodiscard]] DurationHistogram since(const DurationHistogram& earlier) const noexcept;
  [[nodiscard]] double max_us() const noexcept { return static_cast<double>(max_ns_) / 1000.0; }

 private:
  // 32 bins for each power of two of nanoseconds.
  static constexpr int kSubBits = 5;
  static constexpr int kBins = 44 << kSubBits;
  std::array<std::uint32_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0, sum_ns_ = 0;
};

// Statistics of a periodic loop.
struct TickStats {
  DurationHistogram lateness;  // start of the tick after its due time
  DurationHistogram work;      // from start to end of the tick
  std::uint64_t missed = 0;    // periods without a tick, because the previous tick was late
  [[nodiscard]] TickStats since(const TickStats& earlier) const noexcept {
    return {lateness.since(earlier.lateness), work.since(earlier.work), missed - earlier.missed};
  }
};

}  // namespace osteon
