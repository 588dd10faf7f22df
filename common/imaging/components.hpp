// Connected components of a mask, as runs of voxels along the rows of pixels.
#pragma once
#include <array>
#include <bitset>
#include <cstdint>
#include <vector>

#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

// A run of voxels within one row of pixels. Both ends are included.
struct VoxelRun {
  std::int32_t first = 0, last = 0;
  std::int32_t row = 0, slice = 0;
  std::uint32_t component = 0;
};

enum class Connectivity {
  faces,    // 6 neighbours, for what is not bone
  corners,  // 26 neighbours, for bone
};

struct Components {
  std::vector<VoxelRun> runs;  // by slice, then row, then column
  std::uint32_t count = 0;     // components, numbered from 0 in the order of their first voxels

  [[nodiscard]] std::vector<std::int64_t> voxels() const;  // of each component
};

// Components of the voxels whose value is in `of`. Error: cancelled.
[[nodiscard]] Result<Components> find_components(const VoxelMask& mask, const std::bitset<256>& of,
                                                 Connectivity connectivity, const KeepGoing& keep_going);

// Whether any voxel of the mask along a run is not 0, and how many are not.
[[nodiscard]] bool any_in_run(const VoxelMask& mask, const VoxelRun& run);
[[nodiscard]] std::int64_t count_in_run(const VoxelMask& mask, const VoxelRun& run);
void fill_run(VoxelMask& mask, const VoxelRun& run, std::uint8_t value);

}  // namespace osteon::imaging
