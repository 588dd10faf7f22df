// From the scanner's grid to the bone's lattice.
#pragma once
#include <span>

#include "common/imaging/hu_volume.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::imaging {

// Trilinear HU at exactly (i, j, k) · pitch in LPS, for every sample of the box. Beyond the outer voxels' centres
// the value goes on as at the nearest of them. Error: cancelled.
[[nodiscard]] Result<DenseVolume<float>> resample(const HuVolume& volume, const CoordBox& box, double pitch_mm,
                                                  const KeepGoing& keep_going);

// The same of one box into memory for all its samples, z fastest.
void resample(const HuVolume& volume, const CoordBox& box, double pitch_mm, std::span<float> out);

}  // namespace osteon::imaging
