// Finds the HU at which the surface of a bone lies, place by place.
#pragma once
#include <algorithm>
#include <cstdint>

#include "common/core/sparse_bytes.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

// A threshold, and by how much the level of the surface exceeds it near the surface.
struct SurfaceLevel {
  static constexpr int kStep_hu = 8;

  double threshold_hu = 0.0;
  SparseBytes above = {};  // of the scan's voxels, in steps; empty: the threshold is the level everywhere

  // HU, lowered so that they cross the threshold where they cross a level that is `steps` above it.
  [[nodiscard]] static std::int16_t lowered(std::int16_t hu, int steps) {
    return static_cast<std::int16_t>(std::max(-32768, hu - kStep_hu * steps));
  }
  // The same of voxel `i`.
  [[nodiscard]] std::int16_t lowered(const HuVolume& volume, std::size_t i) const {
    return above.empty() ? volume.values[i] : lowered(volume.values[i], above[i]);
  }
};

// A scanner blurs the edge of a bone. Its true place is where HU are half way between those of the bone and those of
// what lies beside it (Spoor 1993). A fixed threshold far below lies outside, the more so the denser the bone. So at
// each voxel near the surface a profile along the gradient of HU gives the highest HU on the way in, and the lowest on
// the way out. Where the mean of the two is above the threshold, it is the level. Thin bone that the scan shows as grey
// has a low level, and stays. Metal behind bone counts as compact bone.
//
// `bones`: the bone number of each voxel; 0: none. Voxels below their level, between the surface and bone, lose it. No
// voxel gets one. Two bones that touch have a surface between them. Errors: invalid_input (too many
// voxels), cancelled.
[[nodiscard]] Result<SurfaceLevel> move_to_half_maximum(const HuVolume& volume, double threshold_hu, VoxelMask& bones,
                                                        const KeepGoing& keep_going);

}  // namespace osteon::imaging
