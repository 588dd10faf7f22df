// How deep each voxel lies in bone: a distance to the outside in which dense bone counts more.
#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

inline constexpr std::uint16_t kDeepest = std::numeric_limits<std::uint16_t>::max();

struct BoneDepth {
  std::vector<std::uint16_t> values;  // of each voxel, in units; 0 outside bone. kDeepest: that or more
  double unit_mm = 0.0;               // of dense bone
};

// A grey-weighted distance (Rutovitz 1968): the least weight of a path over the 26 neighbours from the voxel to one
// that is not in the mask. A millimetre weighs 1/16 at the threshold and 1 from 800 HU above it on, and between them
// grows with the square of what is above it, as the strength of bone does. So a seam between two bones is shallow if
// slices of 3 mm blur it to values above the threshold. Voxels below the threshold weigh 1, because marrow is no seam.
// What lies beyond the scan does not count as outside. `volume` and `mask` have the same voxels. Errors: invalid_input
// (more voxels than numbers of 32 bits), cancelled.
[[nodiscard]] Result<BoneDepth> bone_depth(const HuVolume& volume, const VoxelMask& mask, double threshold_hu,
                                           const KeepGoing& keep_going);

}  // namespace osteon::imaging
