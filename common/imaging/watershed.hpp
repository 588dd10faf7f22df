// Marker-controlled watershed: separates bones that touch.
#pragma once
#include "common/core/keep_going.hpp"
#include "common/imaging/bone_depth.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

inline constexpr int kMostMarkers = 254;

// Floods the mask from the markers, the deepest voxels first (Beucher and Meyer 1993, with the negative depth as relief
// and without a watershed line). Each voxel takes the number of the flood that reaches it first, so two floods meet
// where the bone between their markers is shallowest. They go over faces. What only touches them at an edge or corner
// follows when all else is done. A part of the mask without a marker stays 0. `markers`: 0, or a number up to
// kMostMarkers; becomes the result. All have the same voxels. Errors: cancelled, exhausted (memory), internal.
[[nodiscard]] Result<VoxelMask> watershed(const VoxelMask& mask, BoneDepth depth, VoxelMask markers,
                                          const KeepGoing& keep_going);

}  // namespace osteon::imaging
