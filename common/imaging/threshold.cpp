#include "common/imaging/threshold.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "common/core/check.hpp"
#include "common/imaging/calibration.hpp"

namespace osteon::imaging {
namespace {

// [A] Below fat, which has -100 to -50 HU (Niu 2008, table 3.1), with room for noise.
constexpr int kFat_hu = -200;
// [A] Above muscle, blood and discs without contrast medium, whose mean lies below it. A lower threshold would part fat
// from muscle.
constexpr int kLowest_hu = 110;
// [A] The mean of what lies above the threshold. Below it, that is the end of the soft tissue and not bone.
constexpr double kLeastBone_hu = 200.0;
// [A] Of the voxels that count. A smaller class is a few wrong voxels, and no tissue.
constexpr double kLeastShare = 0.001;
// A whole HU stands for values up to half a HU away. Their variance keeps a class of one value from being a point.
constexpr double kWithinOne = 1.0 / 12.0;

int most_hu() { return static_cast<int>(hounsfield(kRho1995, kCompactBone_g_cm3)); }

// Sums over the voxels of a class.
struct Sums {
  double voxels = 0.0, hu = 0.0, squares = 0.0;

  [[nodiscard]] double mean() const { return hu / voxels; }
  [[nodiscard]] double variance() const { return std::max(0.0, squares / voxels - mean() * mean()) + kWithinOne; }
};

Sums operator-(const Sums& a, const Sums& b) { return {a.voxels - b.voxels, a.hu - b.hu, a.squares - b.squares}; }

TissueClass tissue(const Sums& sums, double all) {
  return {sums.mean(), std::sqrt(sums.variance()), sums.voxels / all};
}

// The criterion of Kittler 1986, without its constant: a threshold with a smaller one makes fewer errors.
double criterion(const Sums& low, const Sums& high) {
  const double all = low.voxels + high.voxels, p = low.voxels / all, q = high.voxels / all;
  return p * std::log(low.variance()) + q * std::log(high.variance()) - 2.0 * (p * std::log(p) + q * std::log(q));
}

std::string reason_of(const ThresholdSuggestion& found) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(),
                "%.0f HU parts soft tissue (%.0f +- %.0f HU) from bone (%.0f +- %.0f HU, %.1f %% of both) with the "
                "fewest errors; air and metal do not count",
                found.threshold_hu, found.soft.mean_hu, found.soft.deviation_hu, found.bone.mean_hu,
                found.bone.deviation_hu, 100.0 * found.bone.part);
  return text.data();
}

}  // namespace

Result<std::vector<std::int64_t>> hu_histogram(const HuVolume& volume, const KeepGoing& keep_going) {
  std::vector<std::int64_t> histogram(kHuValues, 0);
  const std::size_t area = static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]);
  for (int slice = 0; slice < volume.dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / volume.dims[2])) return stopped_while("counting the scan's values");
    const std::int16_t* hu = volume.values.data() + volume.index(0, 0, slice);
    for (std::size_t i = 0; i < area; ++i) ++histogram[static_cast<std::size_t>(hu[i] - kLeastHu)];
  }
  return histogram;
}

Result<ThresholdSuggestion> suggest_threshold(std::span<const std::int64_t> histogram) {
  OSTEON_CHECK(histogram.size() == static_cast<std::size_t>(kHuValues));
  // Sums over all HU below each one.
  std::vector<Sums> below{Sums{}};
  for (int hu = kFat_hu; hu <= most_hu(); ++hu) {
    const auto voxels = static_cast<double>(histogram[static_cast<std::size_t>(hu - kLeastHu)]);
    Sums next = below.back();
    next.voxels += voxels;
    next.hu += voxels * hu;
    next.squares += voxels * hu * hu;
    below.push_back(next);
  }
  const auto sums_below = [&](int hu) { return below[static_cast<std::size_t>(hu - kFat_hu)]; };
  const Sums& all = below.back();
  // The first and the last threshold with the least criterion: between them no voxel lies.
  double least = std::numeric_limits<double>::max();
  int first = 0, last = 0, lowest = 0, highest = 0;
  for (int hu = kLowest_hu; hu <= most_hu(); ++hu) {
    const Sums low = sums_below(hu), high = all - low;
    if (!(std::min(low.voxels, high.voxels) > kLeastShare * all.voxels)) continue;
    if (lowest == 0) lowest = hu;
    highest = hu;
    const double here = criterion(low, high);
    if (here < least) first = hu;
    if (here <= least) last = hu;
    least = std::min(least, here);
  }
  // The least at a limit is no valley between two tissues, but the slope of one.
  const bool valley = lowest < last && first < highest;
  const Sums low = sums_below(std::max(first, kLowest_hu)), high = all - low;
  if (!valley || low.mean() >= kLowest_hu || high.mean() < kLeastBone_hu)
    return failure(ErrorCode::invalid_input,
                   "no threshold parts bone from soft tissue in this scan; give --threshold a number of HU");
  ThresholdSuggestion found;
  found.threshold_hu = (first + last) / 2;
  found.soft = tissue(low, all.voxels);
  found.bone = tissue(high, all.voxels);
  found.reason = reason_of(found);
  return found;
}

}  // namespace osteon::imaging
