#include "viewer_client/imaging/hu_histogram.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {

HuHistogram histogram_of(const ShownScan& scan) {
  HuHistogram histogram;
  for (const std::int16_t hu : scan.values)
    ++histogram.counts[static_cast<std::size_t>(std::clamp((hu - kFirst_hu) / kBin_hu, 0, kBins - 1))];
  return histogram;
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
