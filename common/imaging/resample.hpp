// Resamples a scan from the scanner's grid to the bone's lattice.
#pragma once
#include <span>

#include "common/imaging/hu_volume.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::imaging {

// Trilinear HU at exactly (i, j, k) · pitch in LPS, for every sample of the box. Beyond the centres of the outer
// voxels the value of the nearest one continues. Error: cancelled.
[[nodiscard]] Result<DenseVolume<float>> resample(const HuVolume& volume, const CoordBox& box, double pitch_mm,
                                                  const KeepGoing& keep_going);

// The same for one box, into memory for all its samples, z fastest.
void resample(const HuVolume& volume, const CoordBox& box, double pitch_mm, std::span<float> out);

}  // namespace osteon::imaging
