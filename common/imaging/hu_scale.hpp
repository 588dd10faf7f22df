// The scale of a scan's Hounsfield units, read from its own air and soft tissue.
#pragma once
#include <cstdint>
#include <span>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/hu_volume.hpp"

namespace osteon::imaging {

// [A] What muscle, blood and brain have on a scanner whose scale is right, and how much that differs between people,
// regions and tube voltages.
inline constexpr double kSoftTissue_hu = 45.0, kSoftTissueError_hu = 20.0;

// What the scan shows of both.
struct HuScale {
  double air_hu = 0.0, soft_tissue_hu = 0.0;

  // The value that a right scale has for one of this scan.
  [[nodiscard]] double corrected(double hu) const;
  // Standard error of a corrected value, because nobody knows the soft tissue exactly.
  [[nodiscard]] static double error_hu(double corrected_hu);
};

// Air is the lowest peak of the histogram from -1200 to -800 HU. Soft tissue is the highest one from -100 to 200 HU, so
// not fat. A value that fills the space beside the scanned circle is no peak. `histogram`: of hu_histogram(). Error:
// invalid_input (no such peaks).
[[nodiscard]] Result<HuScale> measure_hu_scale(std::span<const std::int64_t> histogram);

// Corrects every voxel, rounded to whole HU. Error: cancelled.
[[nodiscard]] Result<void> rescale_hu(HuVolume& volume, const HuScale& scale, const KeepGoing& keep_going);

}  // namespace osteon::imaging
