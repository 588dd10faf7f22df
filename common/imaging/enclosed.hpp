// What a mask encloses.
#pragma once
#include "common/imaging/segmentation.hpp"

namespace osteon::imaging {

// 1 for every voxel outside `solid` that is enclosed by it, as segment_bone() says: the marrow spaces. Error:
// cancelled.
[[nodiscard]] Result<VoxelMask> enclosed_by(const VoxelMask& solid, const Vec3& spacing_mm,
                                            const SegmentationParams& params, const ScanEnds& ends,
                                            const KeepGoing& keep_going);

}  // namespace osteon::imaging
