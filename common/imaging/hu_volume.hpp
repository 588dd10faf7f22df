// A CT volume as it was scanned: Hounsfield units on the scanner's own grid.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"

namespace osteon::imaging {

// Voxels along an axis. A file that says more is damaged.
inline constexpr int kLargestScanAxis = 1 << 14;

// The nearest whole number of HU that a voxel can have. Not for NaN. A call of std::lround() takes much longer.
[[nodiscard]] inline std::int16_t nearest_hu(double hu) {
  constexpr double least = std::numeric_limits<std::int16_t>::min(), most = std::numeric_limits<std::int16_t>::max();
  return static_cast<std::int16_t>(std::clamp(hu, least, most) + (hu < 0.0 ? -0.5 : 0.5));
}

struct HuVolume {
  std::array<int, 3> dims{};                                 // columns, rows, slices
  Vec3 spacing_mm = Vec3::Ones();                            // between neighbours along each
  Vec3 origin_mm = Vec3::Zero();                             // centre of the first voxel, LPS
  Eigen::Matrix3d directions = Eigen::Matrix3d::Identity();  // orthonormal: directions of columns, rows and slices, LPS
  std::vector<std::int16_t> values;                          // columns fastest, then rows, then slices

  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(dims[2]);
  }
  [[nodiscard]] std::size_t index(int column, int row, int slice) const {
    return (static_cast<std::size_t>(slice) * static_cast<std::size_t>(dims[1]) + static_cast<std::size_t>(row)) *
               static_cast<std::size_t>(dims[0]) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] std::int16_t at(int column, int row, int slice) const { return values[index(column, row, slice)]; }

  // Voxel coordinates count voxels from the centre of the first voxel.
  [[nodiscard]] Vec3 position_mm(const Vec3& voxel) const {
    return origin_mm + directions * spacing_mm.cwiseProduct(voxel);
  }
  [[nodiscard]] Vec3 voxel(const Vec3& position_mm) const {
    return (directions.transpose() * (position_mm - origin_mm)).cwiseQuotient(spacing_mm);
  }
};

// A box of voxels: columns, rows, slices; both ends included.
struct VoxelBox {
  std::array<int, 3> first{}, last{};

  [[nodiscard]] int dim(std::size_t axis) const { return last[axis] - first[axis] + 1; }
  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(dim(0)) * static_cast<std::size_t>(dim(1)) * static_cast<std::size_t>(dim(2));
  }
  // Of a voxel of the volume in an array over this box, columns fastest.
  [[nodiscard]] std::size_t index(int column, int row, int slice) const {
    return (static_cast<std::size_t>(slice - first[2]) * static_cast<std::size_t>(dim(1)) +
            static_cast<std::size_t>(row - first[1])) *
               static_cast<std::size_t>(dim(0)) +
           static_cast<std::size_t>(column - first[0]);
  }
  [[nodiscard]] bool contains(const VoxelBox& other) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (other.first[axis] < first[axis] || other.last[axis] > last[axis]) return false;
    return true;
  }
};

// "256x256x108, 0.957x0.957x1.5 mm"
[[nodiscard]] std::string describe(const HuVolume& volume);

// The voxels from `first` to `last`, both included, as a separate volume at the same position. Takes over the memory of
// `volume`. Error: cancelled.
[[nodiscard]] Result<HuVolume> cropped(HuVolume volume, const std::array<int, 3>& first, const std::array<int, 3>& last,
                                       const KeepGoing& keep_going);

// The LPS box around voxel coordinates first .. last (both included), measured at the voxel centres.
[[nodiscard]] Box enclosing_box(const HuVolume& volume, const Vec3& first, const Vec3& last);

// Distance from the block of space that was scanned (whole voxels, so half a voxel beyond the outer centres). Negative
// inside it, exact inside and beside its faces.
[[nodiscard]] double outside_scan_mm(const HuVolume& volume, const Vec3& position_mm);

}  // namespace osteon::imaging
