// How often each HU is in a scan, as a curve on which a person drags limits.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "viewer_client/imaging/scan_file.hpp"

namespace osteon {

// Bins of equal width from kFirst_hu on. What lies beyond the ends counts in the bin at that end.
inline constexpr int kFirst_hu = -1024, kBin_hu = 16, kBins = 256;

struct HuHistogram {
  std::array<std::int64_t, kBins> counts{};  // voxels
};
[[nodiscard]] HuHistogram histogram_of(const ShownScan& scan);

// Heights from 0 to 1 on a logarithmic scale, so that a small bone shows beside all the air. The fullest bin has 1.
[[nodiscard]] std::vector<double> heights_of(const HuHistogram& histogram);

// Places along the axis, of a width in pixels.
[[nodiscard]] double pixel_of_hu(double hu, double width_px);
[[nodiscard]] double hu_of_pixel(double x_px, double width_px);

}  // namespace osteon
