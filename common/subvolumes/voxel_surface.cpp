#include "common/subvolumes/voxel_surface.hpp"

#include <algorithm>

#include "common/surface/marching_cubes.hpp"

namespace osteon::subvolumes {
namespace {

constexpr int kSlicesAtOnce = 16;  // of a box: work between two questions whether to go on

// Corner i of a cell lies at (i >> 2 & 1, i >> 1 & 1, i & 1), as in MarchingCubesTable.
std::array<int, 3> corner_at(int corner) { return {corner >> 2 & 1, corner >> 1 & 1, corner & 1}; }

template <class Value>
void march(const MaskedBox<Value>& box, const BoneVoxels& voxels, TriangleMesh& mesh) {
  const MarchingCubesTable& table = marching_cubes_table();
  const auto least = static_cast<Value>(voxels.least_bone_hu());
  const double iso = voxels.least_bone_hu() - 0.5;
  const bool mirrored = voxels.geometry.axes_mm.determinant() < 0.0;  // the triangles then turn the other way
  std::array<std::ptrdiff_t, 8> offset{};
  for (int corner = 0; corner < 8; ++corner) {
    const auto [x, y, z] = corner_at(corner);
    offset[to_index(corner)] = x * box.strides[0] + y * box.strides[1] + z * box.strides[2];
  }
  // Corners 0 to 3 are of one column, 4 to 7 of the next.
  const auto column_bits = [&](const Value* at) {
    int bits = 0;
    for (int corner = 0; corner < 4; ++corner)
      bits |= static_cast<int>(at[offset[to_index(corner)]] >= least) << corner;
    return bits;
  };
  const auto add = [&](Coord cell, const Value* at, const CellCase& found) {
    for (int i = 0; i < found.corners; ++i) {
      const int side = i % 3;
      const int of = mirrored && side > 0 ? i - side + 3 - side : i;
      const CellEdge edge = table.edges[found.edges[to_index(of)]];
      const int end = edge.corner | 4 >> edge.axis;
      const double low = at[offset[edge.corner]], high = at[offset[to_index(end)]];
      const auto [x, y, z] = corner_at(edge.corner);
      Vec3 voxel(cell.x + x, cell.y + y, cell.z + z);
      voxel[edge.axis] += (iso - low) / (high - low);
      const Eigen::Vector3f point = voxels.geometry.position_mm(voxel).cast<float>();
      mesh.positions_mm.push_back({point.x(), point.y(), point.z()});
    }
    const auto first = static_cast<std::uint32_t>(mesh.positions_mm.size() - found.corners);
    for (std::uint32_t i = 0; i < found.corners; i += 3)
      mesh.triangles.push_back({first + i, first + i + 1, first + i + 2});
  };
  const Coord dims = box.box.dims();
  for (int z = 0; z + 1 < dims.z; ++z)
    for (int y = 0; y + 1 < dims.y; ++y) {
      const Value* at = box.values.data() + y * box.strides[1] + z * box.strides[2];
      int bits = column_bits(at);
      for (int x = 0; x + 1 < dims.x; ++x, at += box.strides[0]) {
        const int next = column_bits(at + box.strides[0]);
        const int solid = bits | next << 4;
        bits = next;
        if (solid != 0 && solid != 255) add(box.box.min + Coord{x, y, z}, at, table.cases[to_index(solid)]);
      }
    }
}

// The masked HU of a box, with air beyond the scan.
void copy_masked(const BoneVoxels& voxels, const CoordBox& box, std::vector<std::int16_t>& values) {
  const Coord dims = box.dims();
  const std::int16_t least = voxels.least_bone_hu(), air = masked_hu(kAir_hu, false, least);
  values.assign(static_cast<std::size_t>(voxels_of(box)), air);
  const CoordBox part = common_box(box, voxels.box());
  if (part.empty()) return;
  for (int z = part.min.z; z <= part.max.z; ++z)
    for (int y = part.min.y; y <= part.max.y; ++y) {
      std::size_t from = voxels.index({part.min.x, y, z});
      std::size_t to = (to_index(z - box.min.z) * to_index(dims.y) + to_index(y - box.min.y)) * to_index(dims.x) +
                       to_index(part.min.x - box.min.x);
      for (int x = part.min.x; x <= part.max.x; ++x, ++from)
        values[to++] = masked_hu(voxels.hu[from], voxels.bone[from] != 0, least);
    }
}

}  // namespace

void add_triangles(const MaskedBox<std::int16_t>& box, const BoneVoxels& voxels, TriangleMesh& mesh) {
  march(box, voxels, mesh);
}
void add_triangles(const MaskedBox<float>& box, const BoneVoxels& voxels, TriangleMesh& mesh) {
  march(box, voxels, mesh);
}

std::vector<CoordBox> cell_boxes(std::span<const CoordBox> sections) {
  std::vector<CoordBox> boxes;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const bool follows = i > 0 && sections[i - 1].max.z + 1 == sections[i].min.z;
    CoordBox box = sections[i];
    if (i + 1 < sections.size() && sections[i + 1].min.z == box.max.z + 1) {
      const CoordBox both = box_around(box, sections[i + 1]);
      box = {{both.min.x, both.min.y, box.min.z}, {both.max.x, both.max.y, box.max.z}};
    }
    box = box.grown(1);
    if (follows) ++box.min.z;
    boxes.push_back(box);
  }
  return boxes;
}

Result<TriangleMesh> reconstruct(const BoneVoxels& voxels, std::span<const CoordBox> boxes,
                                 const KeepGoing& keep_going) {
  std::int64_t all = 0, done = 0;
  for (const CoordBox& box : boxes) all += voxels_of(box);
  TriangleMesh mesh;
  std::vector<std::int16_t> values;
  for (const CoordBox& box : boxes)
    for (int z = box.min.z; z < box.max.z; z += kSlicesAtOnce) {
      if (!keep_going(static_cast<double>(done) / static_cast<double>(all)))
        return stopped_while("reconstructing the surface");
      // The last slice of a part is the first of the next, so that no cell is left out.
      CoordBox part = box;
      part.min.z = z;
      part.max.z = std::min(box.max.z, z + kSlicesAtOnce);
      copy_masked(voxels, part, values);
      const Coord dims = part.dims();
      add_triangles(MaskedBox<std::int16_t>{part, values, {1, dims.x, std::ptrdiff_t{dims.x} * dims.y}}, voxels, mesh);
      done += voxels_of(part);
    }
  return mesh;
}

}  // namespace osteon::subvolumes
