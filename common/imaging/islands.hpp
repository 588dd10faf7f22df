// Finds the separate parts of bone in a scan, and numbers those that are kept.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/imaging/components.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/volume/case.hpp"

namespace osteon::imaging {

// An island: voxels of bone that are connected across faces, edges or corners.
struct Island {
  std::int64_t voxels = 0;
  double volume_cm3 = 0.0;        // of its voxels
  double density_g_cm3 = 0.0;     // mean over its voxels
  Vec3 centre_mm = Vec3::Zero();  // of its voxels, LPS
  std::array<int, 3> first{};     // voxel box, both ends included
  std::array<int, 3> last{};
};

struct Islands {
  std::vector<Island> list;  // largest first; equal ones in memory order. Number N is list[N - 1].
  Components components;
  std::vector<int> number;  // of each component, from 1
};

// Islands of the voxels that are not 0. Contrast medium and bone are islands of their own where they touch. Error:
// cancelled.
[[nodiscard]] Result<Islands> find_islands(const HuVolume& volume, const VoxelMask& bone,
                                           const DensityCalibration& calibration, const KeepGoing& keep_going);

// A mask of the volume's dims with bone numbers, from 1, for voxels of the kept islands, and 0 for all others. The
// islands `kept`, by number, become bones 1, 2, 3 ... in this order. With `merge`, all of them are bone 1. From the
// 255th on they share the number 255.
[[nodiscard]] VoxelMask number_bones(const Islands& islands, std::span<const int> kept, bool merge,
                                     const std::array<int, 3>& dims);

}  // namespace osteon::imaging
