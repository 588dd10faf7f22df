// Makes a field over a scan's voxels. It crosses the threshold at the surface of the kept bones.
#pragma once
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

// Kept dense voxels keep their HU. All outside voxels end below the threshold; voxels of other islands get the last
// whole HU below it. A trilinear cell with a voxel of a kept island has no voxel of another island, because they would
// be 26-neighbours. So the kept surface does not move. Kept marrow is raised above the threshold. Where marrow meets
// air, the surface is half way between their values. Where it meets anything else, the surface is half way between the
// voxels. `bones`: not 0 for kept voxels. Error: cancelled.
[[nodiscard]] Result<HuVolume> bone_field(const HuVolume& volume, const VoxelMask& bones, double threshold_hu,
                                          const KeepGoing& keep_going);

}  // namespace osteon::imaging
