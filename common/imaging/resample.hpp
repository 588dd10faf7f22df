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

// The same for one box, into memory for all its samples, z fastest. `voxels`: the HU of `part` instead of those of the
// volume, which need not have any; the part must contain voxels_for() the box.
void resample(const HuVolume& volume, const VoxelBox& part, std::span<const std::int16_t> voxels, const CoordBox& box,
              double pitch_mm, std::span<float> out);

// Trilinear HU at a point in voxel coordinates. Beyond the outer voxels as above.
[[nodiscard]] double hu_at(const HuVolume& volume, const Vec3& voxel);

// All voxels that give the samples of a box their HU, and a few beside them.
[[nodiscard]] VoxelBox voxels_for(const HuVolume& volume, const CoordBox& box, double pitch_mm);

}  // namespace osteon::imaging
