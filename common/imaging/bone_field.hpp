// A field over a scan's voxels whose crossing of the threshold is the surface of the kept bones.
#pragma once
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

// HU where a voxel is dense bone that is kept, and where it is outside and below the threshold. Voxels of other islands go to
// the last whole HU below the threshold: a trilinear cell with a voxel of a kept island has none of another (they would be
// 26-neighbours), so the kept surface does not move. Voxels of kept marrow go above it, so that the surface lies half way
// between the values of marrow and air where it meets air, and half way between the voxels elsewhere.
// `bones`: not 0 where the voxel is kept. Error: cancelled.
[[nodiscard]] Result<HuVolume> bone_field(const HuVolume& volume, const VoxelMask& bones, double threshold_hu, const KeepGoing& keep_going);

}  // namespace osteon::imaging
