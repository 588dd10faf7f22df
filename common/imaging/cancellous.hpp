// Finds cancellous bone below the threshold that dense bone bounds but does not enclose.
#pragma once
#include "common/imaging/segmentation.hpp"

namespace osteon::imaging {

// 1 for every such voxel, as segment_bone() defines it. `dense`: the voxels at or above the threshold. Error:
// cancelled.
[[nodiscard]] Result<VoxelMask> cancellous_between(const HuVolume& volume, const VoxelMask& dense,
                                                   const SegmentationParams& params, const KeepGoing& keep_going);

}  // namespace osteon::imaging
