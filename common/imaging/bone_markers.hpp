// Markers for the watershed: from seeds that a person gives, or from the cores of bones.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/imaging/bone_depth.hpp"
#include "common/imaging/voxel_mask.hpp"
#include "common/imaging/watershed.hpp"

namespace osteon::imaging {

// A seed in bone, and the number of the bone that it stands for, from 1 to kMostMarkers.
struct BoneSeed {
  std::array<int, 3> voxel{};
  int number = 0;
};

// A core is deep bone around which bone gets shallower. Two cores are of one bone if some path between them is nowhere
// shallower than this part of the depth of the shallower core: h-maxima of the logarithm of the depth, with h = log 2.
// [A] A part, not a length, because the neck of a large bone is deeper than the whole of a small one.
inline constexpr double kNeck = 0.5;
// [A] A bone is at least that deep, mm of dense bone. Spurs and ridges are shallower.
inline constexpr double kLeastCore_mm = 1.0;

// The deepest voxel of each core, the deepest core first. The deepest core of each island counts however shallow it is.
// Errors: exhausted (more than kMostMarkers cores), cancelled.
[[nodiscard]] Result<std::vector<std::array<int, 3>>> bone_cores(const VoxelMask& mask, const BoneDepth& depth,
                                                                 const KeepGoing& keep_going);

// A marker for each seed: the path from it up to the deepest bone that it reaches without getting shallower than
// kSameCore of the depth before. So a seed in the cortex stands for the whole bone and not for a rim of it. Voxels in
// which paths of several bones meet are no marker; a seed always is. Errors: invalid_input (a seed outside the mask,
// seeds of two bones in one voxel, a number above kMostMarkers), cancelled.
inline constexpr double kSameCore = 0.8;  // [A]
[[nodiscard]] Result<VoxelMask> markers_from_seeds(const VoxelMask& mask, const BoneDepth& depth,
                                                   std::span<const BoneSeed> seeds, const KeepGoing& keep_going);

}  // namespace osteon::imaging
