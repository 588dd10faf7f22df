// A field over a scan's voxels. It crosses the level's threshold at the surface of the kept bones.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/imaging/hu_volume.hpp"
#include "common/imaging/surface_level.hpp"
#include "common/imaging/voxel_mask.hpp"
#include "common/volume/narrow_band.hpp"

namespace osteon::imaging {

// HU are lowered by the level first. Kept dense voxels keep them. All outside voxels end below the threshold; dense
// ones get the last whole HU below it. A trilinear cell with a voxel of a kept island has no voxel of another island,
// because they would be 26-neighbours. So the kept surface does not move. Only an edit, a limit of HU or another bone
// leaves a dense voxel outside beside a kept one: the surface is then half way between them. Kept marrow is raised
// above the threshold. Where marrow meets air, the surface is half way between their values. Where it meets anything
// else, the surface is half way between the voxels. A field that is at or above the threshold in the kept voxels and
// nowhere else, in whole numbers, stays as it is. All is worked out part by part, so it takes no memory beside the
// scan's. Any thread.
class BoneField {
 public:
  // `bones`: not 0 for kept voxels. All three must outlive the field. Error: cancelled.
  [[nodiscard]] static Result<BoneField> make(const HuVolume& volume, const SparseMask& bones,
                                              const SurfaceLevel& level, const KeepGoing& keep_going);

  // Which voxels of a part are kept, and therefore at or above the threshold.
  [[nodiscard]] Inside inside(const VoxelBox& part) const;
  // The field at the voxels of a part, columns fastest.
  void read(const VoxelBox& part, std::span<std::int16_t> values) const;

 private:
  BoneField(const HuVolume& volume, const SparseMask& bones, const SurfaceLevel& level);
  [[nodiscard]] std::int16_t marrow_value(const std::array<int, 3>& at, std::size_t i) const;
  [[nodiscard]] std::int16_t outside_value(const std::array<int, 3>& at, std::size_t i) const;

  const HuVolume& volume_;
  const SparseMask& bones_;
  const SurfaceLevel& level_;
  std::int16_t below_;           // the last whole HU below the threshold
  std::array<int, 3> bricks_{};  // along each axis
  std::vector<Inside> brick_;    // of kBrick^3 voxels each
};

}  // namespace osteon::imaging
