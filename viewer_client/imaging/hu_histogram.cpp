#include "viewer_client/imaging/hu_histogram.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {

HuHistogram histogram_of(const ShownScan& scan) {
  const auto bin = [](std::int16_t hu) {
    return static_cast<std::size_t>(std::clamp((hu - kFirst_hu) / kBin_hu, 0, kBins - 1));
  };
  // Neighbours are often alike, and a processor waits for the last sum of a counter. So four histograms take turns.
  constexpr std::size_t kTurns = 4;
  std::array<HuHistogram, kTurns> parts;
  const std::size_t whole = scan.values.size() / kTurns * kTurns;
  for (std::size_t i = 0; i < whole; i += kTurns)
    for (std::size_t turn = 0; turn < kTurns; ++turn) ++parts[turn].counts[bin(scan.values[i + turn])];
  for (std::size_t i = whole; i < scan.values.size(); ++i) ++parts[0].counts[bin(scan.values[i])];
  for (std::size_t turn = 1; turn < kTurns; ++turn)
    for (std::size_t i = 0; i < parts[0].counts.size(); ++i) parts[0].counts[i] += parts[turn].counts[i];
  return parts[0];
}

std::vector<double> heights_of(const HuHistogram& histogram) {
  const double most = std::log1p(static_cast<double>(*std::ranges::max_element(histogram.counts)));
  std::vector<double> heights;
  for (const std::int64_t count : histogram.counts)
    heights.push_back(most > 0.0 ? std::log1p(static_cast<double>(count)) / most : 0.0);
  return heights;
}

double pixel_of_hu(double hu, double width_px) { return (hu - kFirst_hu) / (kBin_hu * kBins) * width_px; }

double hu_of_pixel(double x_px, double width_px) {
  return width_px > 0.0 ? kFirst_hu + x_px / width_px * (kBin_hu * kBins) : kFirst_hu;
}

}  // namespace osteon
