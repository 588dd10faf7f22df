// A mask with one byte for each voxel of a scan, its neighbourhood, and the same with little memory.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/core/large_pages.hpp"
#include "common/core/result.hpp"
#include "common/core/sparse_bytes.hpp"
#include "common/geometry/lattice.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::imaging {

// The place of a voxel in a list: columns fastest, then rows, then slices.
[[nodiscard]] inline std::size_t place_of(const std::array<int, 3>& dims, int column, int row, int slice) {
  return (static_cast<std::size_t>(slice) * static_cast<std::size_t>(dims[1]) + static_cast<std::size_t>(row)) *
             static_cast<std::size_t>(dims[0]) +
         static_cast<std::size_t>(column);
}

struct VoxelMask {
  std::array<int, 3> dims{};         // columns, rows, slices
  std::vector<std::uint8_t> values;  // columns fastest, then rows, then slices; 0: not in the mask

  VoxelMask() = default;
  explicit VoxelMask(std::array<int, 3> size)
      : dims(size),
        values(zeros<std::uint8_t>(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                                   static_cast<std::size_t>(size[2]))) {}
  [[nodiscard]] std::size_t index(int column, int row, int slice) const { return place_of(dims, column, row, slice); }
  [[nodiscard]] std::uint8_t at(int column, int row, int slice) const { return values[index(column, row, slice)]; }
  [[nodiscard]] std::uint8_t& at(int column, int row, int slice) { return values[index(column, row, slice)]; }
};

// A mask that no longer changes, of which most voxels are 0.
struct SparseMask {
  std::array<int, 3> dims{};
  SparseBytes values;  // as those of VoxelMask

  SparseMask() = default;
  explicit SparseMask(const VoxelMask& mask) : dims(mask.dims), values(mask.values) {}
  [[nodiscard]] std::uint8_t at(int column, int row, int slice) const {
    return values[place_of(dims, column, row, slice)];
  }
};

// The voxels from `first` to `last`, both included. Takes over the memory of `mask`. Error: cancelled.
[[nodiscard]] Result<VoxelMask> cropped(VoxelMask mask, const std::array<int, 3>& first, const std::array<int, 3>& last,
                                        const KeepGoing& keep_going);

// 1 for every voxel whose centre is at most `radius_mm` from the centre of a voxel of the mask, including that voxel.
// Exact Euclidean distances on voxels of `spacing_mm`. Error: cancelled.
[[nodiscard]] Result<VoxelMask> within_mm(const VoxelMask& mask, const Vec3& spacing_mm, double radius_mm,
                                          const KeepGoing& keep_going);

}  // namespace osteon::imaging
