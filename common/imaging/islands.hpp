// Which of the bright voxels are the bone: the largest 26-connected island above a threshold.
#pragma once
#include <array>
#include <cstdint>

#include "common/imaging/hu_volume.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::imaging {

struct IslandReport {
  std::int64_t islands = 0;         // how many there were
  std::int64_t kept_voxels = 0;
  std::int64_t removed_voxels = 0;
  std::array<int, 3> first{};       // voxel box of the kept one, both ends included
  std::array<int, 3> last{};
};

// Pulls the voxels of every other island to the last whole HU below the threshold. A trilinear cell with a voxel of
// the kept island has no voxel of another (they would be 26-neighbours), so the kept surface does not move. What lies
// below the threshold, marrow inside the bone too, stays as it is.
// Errors: invalid_input (nothing reaches the threshold), cancelled.
[[nodiscard]] Result<IslandReport> keep_largest_island(HuVolume& volume, double threshold_hu, const KeepGoing& keep_going);

}  // namespace osteon::imaging
