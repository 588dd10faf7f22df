// Finds what a mask encloses.
#pragma once
#include "common/imaging/segmentation.hpp"

namespace osteon::imaging {

// 1 for every voxel outside `solid` that `solid` encloses, as segment_bone() defines it: the marrow spaces. Error:
// cancelled.
[[nodiscard]] Result<VoxelMask> enclosed_by(const VoxelMask& solid, const Vec3& spacing_mm,
                                            const SegmentationParams& params, const ScanEnds& ends,
                                            const KeepGoing& keep_going);

}  // namespace osteon::imaging
