// Finds the HU at which the surface of a bone lies, place by place.
#pragma once
#include <algorithm>
#include <cstdint>

#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

// A threshold, and by how much the level of the surface exceeds it near the surface.
struct SurfaceLevel {
  static constexpr int kStep_hu = 8;

  double threshold_hu = 0.0;
  VoxelMask above = {};  // of the scan's voxels, in steps; empty: the threshold is the level everywhere

  // HU of voxel `i`, lowered so that they cross the threshold where they cross the level.
  [[nodiscard]] std::int16_t lowered(const HuVolume& volume, std::size_t i) const {
    if (above.values.empty()) return volume.values[i];
    return static_cast<std::int16_t>(std::max(-32768, volume.values[i] - kStep_hu * above.values[i]));
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
