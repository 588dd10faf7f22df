// The surface of bone in boxes of voxels by marching cubes (Lorensen 1987): the data reconstruction of Niu 2008, §5.3.
#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/geometry/triangle_mesh.hpp"
#include "common/subvolumes/bone_voxels.hpp"

namespace osteon::subvolumes {

// A box of masked HU, see masked_hu(). Strides: from a value to those of the next column, row and slice.
template <class Value>
struct MaskedBox {
  CoordBox box;
  std::span<const Value> values;
  std::array<std::ptrdiff_t, 3> strides;
};

// Adds the triangles of all cells between the voxels of a box; three positions for each triangle, bone frame. A surface
// lies midway between the last HU of other voxels and the first HU of bone, and is interpolated between two voxels.
void add_triangles(const MaskedBox<std::int16_t>& box, const BoneVoxels& voxels, TriangleMesh& mesh);
void add_triangles(const MaskedBox<float>& box, const BoneVoxels& voxels, TriangleMesh& mesh);

// The boxes of voxels that the sections' surfaces need: each section, one voxel around its columns and rows, and one
// slice at its end, as wide as this section and the next. Also one at its beginning, if no section ends there. So every
// cell with bone belongs to one of them.
[[nodiscard]] std::vector<CoordBox> cell_boxes(std::span<const CoordBox> sections);

// The surface of the bone in the boxes, one after the other. What is beyond the scan is air. Error: cancelled.
[[nodiscard]] Result<TriangleMesh> reconstruct(const BoneVoxels& voxels, std::span<const CoordBox> boxes,
                                               const KeepGoing& keep_going);

}  // namespace osteon::subvolumes
