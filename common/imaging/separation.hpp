// Separates bones that touch each other, by a watershed from seeds or from their cores.
#pragma once
#include <span>

#include "common/imaging/bone_markers.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

// Gives each voxel of `bones` that is not 0 the number of its bone. With seeds: that of the seed, and 0 for a part
// without one. Without seeds: each core is a bone, numbered from the largest on. `volume` has the same voxels. Errors:
// invalid_input (a seed outside the bones, seeds of two bones in one voxel, too many voxels), exhausted (more than
// kMostMarkers cores, memory), cancelled, internal.
[[nodiscard]] Result<VoxelMask> separate_bones(const HuVolume& volume, const VoxelMask& bones, double threshold_hu,
                                               std::span<const BoneSeed> seeds, const KeepGoing& keep_going);

}  // namespace osteon::imaging
