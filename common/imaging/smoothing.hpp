// Filters that take noise out of a CT volume before it is segmented.
#pragma once
#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/hu_volume.hpp"

namespace osteon::imaging {

// Both filters work in place and keep a few slices beside the volume. Beyond its edge the volume continues with the
// nearest voxel. A volume is spoiled if the work is cancelled. Error: cancelled.

// Weighted mean with a Gaussian of `sigma_mm` along each axis. The weights end at four sigma and sum up to 1. Results
// are rounded to whole HU. Above 0; a sigma below a tenth of the spacing changes nothing along that axis.
[[nodiscard]] Result<void> smooth_gaussian(HuVolume& volume, double sigma_mm, const KeepGoing& keep_going);

enum class MedianBox { slice, volume };  // 3 x 3 voxels of a slice, or 3 x 3 x 3 voxels

// The median of each voxel and its neighbours.
[[nodiscard]] Result<void> smooth_median(HuVolume& volume, MedianBox box, const KeepGoing& keep_going);

}  // namespace osteon::imaging
