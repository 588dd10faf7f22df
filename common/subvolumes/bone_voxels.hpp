// The voxels of a scan, and which of them are bone: what Niu 2008, §5, divides into sub-volumes.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "common/geometry/lattice.hpp"
#include "common/volume/case_description.hpp"

namespace osteon::subvolumes {

// HU of air, and of a voxel that a tool has removed.
inline constexpr std::int16_t kAir_hu = -1000;

// A box of voxels has columns as x, rows as y and slices as z, from 0; both ends included.
[[nodiscard]] inline std::int64_t voxels_of(const CoordBox& box) {
  if (box.empty()) return 0;
  const Coord dims = box.dims();
  return std::int64_t{dims.x} * dims.y * dims.z;
}
// The voxels that both boxes have.
[[nodiscard]] inline CoordBox common_box(const CoordBox& a, const CoordBox& b) {
  return {{std::max(a.min.x, b.min.x), std::max(a.min.y, b.min.y), std::max(a.min.z, b.min.z)},
          {std::min(a.max.x, b.max.x), std::min(a.max.y, b.max.y), std::min(a.max.z, b.max.z)}};
}
// The smallest box around both. An empty one adds nothing.
[[nodiscard]] inline CoordBox box_around(const CoordBox& a, const CoordBox& b) {
  if (a.empty() || b.empty()) return a.empty() ? b : a;
  return {{std::min(a.min.x, b.min.x), std::min(a.min.y, b.min.y), std::min(a.min.z, b.min.z)},
          {std::max(a.max.x, b.max.x), std::max(a.max.y, b.max.y), std::max(a.max.z, b.max.z)}};
}

// Does not own its voxels: columns fastest, then rows, then slices. Any thread may read it.
struct BoneVoxels {
  ScanGeometry geometry;
  std::span<const std::int16_t> hu;
  std::span<const std::uint8_t> bone;  // not 0: bone
  double threshold_hu = 0.0;           // at which the surface of bone lies between a voxel of bone and another one

  [[nodiscard]] CoordBox box() const {
    return {{0, 0, 0}, {geometry.dims[0] - 1, geometry.dims[1] - 1, geometry.dims[2] - 1}};
  }
  [[nodiscard]] std::size_t index(Coord voxel) const {
    return (to_index(voxel.z) * to_index(geometry.dims[1]) + to_index(voxel.y)) * to_index(geometry.dims[0]) +
           to_index(voxel.x);
  }
  // The least HU that count as bone. They have half a HU between them and the highest HU of other voxels.
  [[nodiscard]] std::int16_t least_bone_hu() const {
    return static_cast<std::int16_t>(std::ceil(std::clamp(threshold_hu, -1000.0, 32000.0)));
  }
};

// HU for the surface of bone: raised to the least of bone, or lowered below it. So marrow is within the surface, and a
// table is not.
[[nodiscard]] inline std::int16_t masked_hu(std::int16_t hu, bool is_bone, std::int16_t least) {
  return is_bone ? std::max(hu, least) : std::min<std::int16_t>(hu, static_cast<std::int16_t>(least - 1));
}

}  // namespace osteon::subvolumes
