// A field over a scan's voxels whose crossing of the threshold is the surface of the kept bones.
#pragma once
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

// Kept dense voxels keep their HU. All outside voxels end below the threshold: those of other islands get the last
// whole HU below it. A trilinear cell with a voxel of a kept island has none of another (they would be 26-neighbours),
// so the kept surface does not move. Kept marrow is raised above the threshold. Where marrow meets air, the surface
// lies half way between their values; where it meets anything else, half way between the voxels. `bones`: not 0 where
// the voxel is kept. Error: cancelled.
[[nodiscard]] Result<HuVolume> bone_field(const HuVolume& volume, const VoxelMask& bones, double threshold_hu,
                                          const KeepGoing& keep_going);

}  // namespace osteon::imaging
