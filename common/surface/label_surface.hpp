// The surface of what the voxels of a label are.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace osteon {

// Where the centres of voxels lie, bone frame, mm: origin + axes · (column, row, slice).
struct VoxelGrid {
  std::array<int, 3> dims{};  // columns, rows, slices
  Vec3 origin_mm = Vec3::Zero();
  Eigen::Matrix3d axes_mm = Eigen::Matrix3d::Identity();
  [[nodiscard]] double longest_edge_mm() const { return axes_mm.colwise().norm().maxCoeff(); }
};

// Fills a slice: 1 for a voxel of the label, 0 for others; columns fastest, then rows. Called for each slice in order.
using ReadSlice = std::function<void(int slice, std::span<std::uint8_t> voxels)>;

// Marching cubes through the voxels' centres. A point begins in the middle between a centre inside and one outside.
// Then the steps of voxels are smoothed away (Taubin 1995): a point moves along the line between its two centres, by at
// most 0.3 of their distance. So each centre stays on its side, and a thin structure keeps its width. Closed, outwards,
// and without normals. Outside the grid nothing is labelled. Error exhausted: more than `most_triangles`.
[[nodiscard]] Result<TriangleMesh> label_surface(const VoxelGrid& grid, const ReadSlice& read,
                                                 std::size_t most_triangles);

}  // namespace osteon
