// What corrections by hand change in one plane of a scan, before osteon-import makes the bone.
#pragma once
#include <array>
#include <bitset>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer_client/imaging/imaging_edits.hpp"
#include "viewer_client/imaging/island_map.hpp"
#include "viewer_client/imaging/plane_view.hpp"

namespace osteon {

// Voxels of a scan, both ends included.
struct VoxelRange {
  std::array<int, 3> first{}, last{-1, -1, -1};

  [[nodiscard]] bool contains(const std::array<int, 3>& voxel) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (voxel[axis] < first[axis] || voxel[axis] > last[axis]) return false;
    return true;
  }
  friend bool operator==(const VoxelRange&, const VoxelRange&) = default;
};
// All voxels without a box.
[[nodiscard]] VoxelRange range_of(const ScanGeometry& scan, const std::optional<MarkedBox>& box);

// Whether a stroke changes a voxel of the range.
[[nodiscard]] bool reaches(const ScanGeometry& scan, const VoxelRange& range, const Correction& stroke);

// The bones that grow in each island, by their numbers.
using BonesOfIslands = std::array<std::bitset<256>, 256>;

// Of several bones in one place, the one whose tint is shown: the lowest. 0: there is none.
[[nodiscard]] int shown_bone(const std::bitset<256>& bones);

// Of each pixel of a plane, rows from the top: 0, or the number of the bone that is painted there, or kErased. Empty:
// there are no corrections. They come in their order, as osteon-import replays them. Where one island has several
// bones, nobody knows yet where the importer parts them: a cut of one shows on the whole island.
inline constexpr std::uint8_t kErased = 255;
[[nodiscard]] std::vector<std::uint8_t> corrected_plane(const ScanGeometry& scan, const IslandMap& islands,
                                                        const BonesOfIslands& bones, const PlaneAxes& axes, int slice,
                                                        std::span<const SharedCorrection> corrections);
// The same of a voxel: the bone that is painted there, or all that grow in its island if no correction reaches it.
[[nodiscard]] std::bitset<256> bones_at(const ScanGeometry& scan, const IslandMap& islands, const BonesOfIslands& bones,
                                        const std::array<int, 3>& voxel, std::span<const SharedCorrection> corrections);

}  // namespace osteon
