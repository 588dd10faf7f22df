#include "common/runtime/tick_stats.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace osteon {
namespace {

constexpr int kSub = 5;

int bin_of(std::uint64_t ns) {
  if (ns < (1u << kSub)) return static_cast<int>(ns);
  const int exponent = 63 - std::countl_zero(ns);
  return ((exponent - kSub + 1) << kSub) + static_cast<int>((ns >> (exponent - kSub)) & ((1u << kSub) - 1));
}

double bin_middle_ns(int bin) {
  if (bin < (1 << kSub)) return bin;
  const int exponent = (bin >> kSub) + kSub - 1;
  const double width = std::ldexp(1.0, exponent - kSub);
  return std::ldexp(1.0, exponent) + (bin & ((1 << kSub) - 1)) * width + 0.5 * width;
}

}  // namespace

void DurationHistogram::record(std::chrono::nanoseconds duration) noexcept {
  const std::int64_t ns = std::max<std::int64_t>(0, duration.count());
  const int bin = std::min(bin_of(static_cast<std::uint64_t>(ns)), kBins - 1);
  ++bins_[static_cast<std::size_t>(bin)];
  ++count_;
  max_ns_ = std::max(max_ns_, ns);
  sum_ns_ += ns;
}

std::uint64_t DurationHistogram::count_up_to(std::chrono::nanoseconds duration) const noexcept {
  if (duration.count() < 0) return 0;
  const int last = std::min(bin_of(static_cast<std::uint64_t>(duration.count())), kBins - 1);
  std::uint64_t counted = 0;
  for (int bin = 0; bin <= last; ++bin) counted += bins_[static_cast<std::size_t>(bin)];
  return counted;
}

DurationHistogram DurationHistogram::since(const DurationHistogram& earlier) const noexcept {
  DurationHistogram later = *this;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) later.bins_[bin] -= earlier.bins_[bin];
  later.count_ -= earlier.count_;
  later.sum_ns_ -= earlier.sum_ns_;
  return later;
}

double DurationHistogram::percentile_us(double percent) const noexcept {
  if (count_ == 0) return 0.0;
  const auto wanted =
      std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::ceil(percent / 100.0 * static_cast<double>(count_))));
  std::uint64_t seen = 0;
  for (int bin = 0; bin < kBins; ++bin) {
    seen += bins_[static_cast<std::size_t>(bin)];
    if (seen >= wanted) return std::min(bin_middle_ns(bin), static_cast<double>(max_ns_)) / 1000.0;
  }
  return max_us();
}

}  // namespace osteon
