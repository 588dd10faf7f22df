// Finds blood with contrast medium, which is as dense as bone.
#pragma once
#include <optional>

#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

// The evidence that a scan has contrast medium: cubes of 7 mm that are as dense as bone and have noise alone.
struct BloodPool {
  double level_hu = 0.0;         // mean of the cubes
  double noise_hu = 0.0;         // standard deviation within them
  double homogeneous_cm3 = 0.0;  // around the centres of the cubes
  double contrast_cm3 = 0.0;     // all that was marked
};

// Gives the voxels of contrast medium the value BoneVoxel::contrast. `dense`: 1 for each voxel at or above the
// threshold. Blood that mixes with contrast medium
// - is homogeneous over a centimetre. Cancellous bone has texture there,
// - has one level. Cancellous bone is brighter in one place than in another,
// - is thicker than cortex,
// - lies in soft tissue. Bone encloses cancellous bone,
// - is darker than the cortex of the same scan.
// A scan without such blood keeps its mask. In doubt it is bone. Error: cancelled.
[[nodiscard]] Result<std::optional<BloodPool>> mark_contrast(const HuVolume& volume, double threshold_hu,
                                                             double metal_hu, VoxelMask& dense,
                                                             const KeepGoing& keep_going);

}  // namespace osteon::imaging
