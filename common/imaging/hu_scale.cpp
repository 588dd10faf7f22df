#include "common/imaging/hu_scale.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/core/check.hpp"
#include "common/imaging/calibration.hpp"
#include "common/imaging/threshold.hpp"

namespace osteon::imaging {
namespace {

struct HuRange {
  int first, last;
};
constexpr HuRange kAirRange{-1200, -800}, kSoftRange{-100, 200};
constexpr double kSmoothing_hu =
    8.0;                            // sigma: narrower than the distance of fat and muscle, wider than noise of counts
constexpr double kLeastPeak = 0.2;  // of the highest peak of a range
constexpr double kLeastOfScan = 0.001;  // of all voxels: fewer are a few bubbles
// A single value with so many times the voxels of its neighbours is a filling, if enough other values are there.
constexpr double kFilling = 20.0;
constexpr double kBesideFilling = 0.1;

// The voxels of each value of a range, smoothed with a Gaussian.
std::vector<double> smooth_counts(const std::vector<double>& counts) {
  constexpr int kReach = static_cast<int>(4.0 * kSmoothing_hu);
  std::vector<double> out(counts.size(), 0.0);
  const int size = static_cast<int>(counts.size());
  for (int i = 0; i < size; ++i) {
    const double count = counts[static_cast<std::size_t>(i)];
    if (count == 0.0) continue;
    for (int j = std::max(0, i - kReach); j <= std::min(size - 1, i + kReach); ++j)
      out[static_cast<std::size_t>(j)] += count * std::exp(-0.5 * std::pow((j - i) / kSmoothing_hu, 2));
  }
  return out;
}

std::vector<double> counts_of(std::span<const std::int64_t> histogram, const HuRange& range) {
  std::vector<double> counts;
  for (int hu = range.first; hu <= range.last; ++hu)
    counts.push_back(static_cast<double>(histogram[static_cast<std::size_t>(hu - kLeastHu)]));
  return counts;
}

// Removes the lowest value if it is a filling beside real air.
void remove_filling(std::vector<double>& counts) {
  const auto lowest = std::ranges::find_if(counts, [](double c) { return c > 0.0; });
  if (lowest == counts.end()) return;
  double rest = 0.0, most = 0.0;
  for (auto c = lowest + 1; c != counts.end(); ++c) {
    rest += *c;
    most = std::max(most, *c);
  }
  if (*lowest > kFilling * most && rest > kBesideFilling * *lowest) *lowest = 0.0;
}

// The mean of the values around a peak, down to half of its height.
double centre_hu(const std::vector<double>& counts, std::size_t peak, const HuRange& range) {
  std::size_t low = peak, high = peak;
  while (low > 0 && counts[low - 1] >= 0.5 * counts[peak]) --low;
  while (high + 1 < counts.size() && counts[high + 1] >= 0.5 * counts[peak]) ++high;
  double sum = 0.0, voxels = 0.0;
  for (std::size_t i = low; i <= high; ++i) {
    sum += counts[i] * static_cast<double>(i);
    voxels += counts[i];
  }
  return range.first + sum / voxels;
}

std::vector<std::size_t> peaks_of(const std::vector<double>& counts) {
  const double most = *std::ranges::max_element(counts);
  std::vector<std::size_t> peaks;
  for (std::size_t i = 1; i + 1 < counts.size(); ++i)
    if (counts[i] > counts[i - 1] && counts[i] >= counts[i + 1] && counts[i] >= kLeastPeak * most) peaks.push_back(i);
  return peaks;
}

Error no_peak(const char* what, const HuRange& range) {
  return {ErrorCode::invalid_input,
          std::string("the scan shows no ") + what + " from " + std::to_string(range.first) + " to " +
              std::to_string(range.last) +
              " HU, so its scale is not known; leave out --rescale-hu, and give --calibration"};
}

double sum_of(const std::vector<double>& counts) {
  double sum = 0.0;
  for (const double c : counts) sum += c;
  return sum;
}

}  // namespace

double HuScale::corrected(double hu) const {
  return kAir_hu + (hu - air_hu) * (kSoftTissue_hu - kAir_hu) / (soft_tissue_hu - air_hu);
}

double HuScale::error_hu(double corrected_hu) {
  return kSoftTissueError_hu * std::abs(corrected_hu - kAir_hu) / (kSoftTissue_hu - kAir_hu);
}

Result<HuScale> measure_hu_scale(std::span<const std::int64_t> histogram) {
  OSTEON_CHECK(histogram.size() == static_cast<std::size_t>(kHuValues));
  double all = 0.0;
  for (const std::int64_t count : histogram) all += static_cast<double>(count);
  std::vector<double> air = counts_of(histogram, kAirRange);
  remove_filling(air);
  std::vector<double> soft = counts_of(histogram, kSoftRange);
  if (sum_of(air) < kLeastOfScan * all) return tl::unexpected(no_peak("air", kAirRange));
  if (sum_of(soft) < kLeastOfScan * all) return tl::unexpected(no_peak("soft tissue", kSoftRange));
  air = smooth_counts(air);
  soft = smooth_counts(soft);
  const auto air_peaks = peaks_of(air), soft_peaks = peaks_of(soft);
  if (air_peaks.empty()) return tl::unexpected(no_peak("air", kAirRange));
  if (soft_peaks.empty()) return tl::unexpected(no_peak("soft tissue", kSoftRange));
  return HuScale{centre_hu(air, air_peaks.front(), kAirRange), centre_hu(soft, soft_peaks.back(), kSoftRange)};
}

Result<void> rescale_hu(HuVolume& volume, const HuScale& scale, const KeepGoing& keep_going) {
  const std::size_t area = static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]);
  for (int slice = 0; slice < volume.dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / volume.dims[2])) return stopped_while("correcting the scale of HU");
    std::int16_t* hu = volume.values.data() + volume.index(0, 0, slice);
    for (std::size_t i = 0; i < area; ++i) hu[i] = nearest_hu(scale.corrected(hu[i]));
  }
  return {};
}

}  // namespace osteon::imaging
