#include "common/surface/marching_cubes.hpp"

#include <utility>
#include <vector>

#include "common/core/check.hpp"

namespace osteon {
namespace {

int edge_between(const MarchingCubesTable& table, int a, int b) {
  const int low = a & b, axis_bit = a ^ b;
  const int axis = axis_bit == 4 ? 0 : axis_bit == 2 ? 1 : 2;
  for (int e = 0; e < kCellEdges; ++e)
    if (table.edges[static_cast<std::size_t>(e)].corner == low && table.edges[static_cast<std::size_t>(e)].axis == axis)
      return e;
  OSTEON_CHECK(false);
}

// Corners of the six faces, counter-clockwise seen from outside the cell.
constexpr int kFaces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};

// The surface cuts each face along segments. One segment goes around every run of solid corners, from the edge where
// the run begins to the edge where it ends. Each crossed edge ends a segment on one of its faces and begins one on the
// other.
std::array<int, kCellEdges> next_edges(const MarchingCubesTable& table, int solid) {
  std::array<int, kCellEdges> next;
  next.fill(-1);
  const auto is_solid = [&](int corner) { return (solid >> corner & 1) != 0; };
  for (const auto& face : kFaces)
    for (int i = 0; i < 4; ++i) {
      if (is_solid(face[i]) || !is_solid(face[(i + 1) % 4])) continue;
      int end = (i + 1) % 4;
      while (is_solid(face[(end + 1) % 4])) end = (end + 1) % 4;
      const int begins = edge_between(table, face[i], face[(i + 1) % 4]);
      const int ends = edge_between(table, face[end], face[(end + 1) % 4]);
      next[static_cast<std::size_t>(begins)] = ends;
    }
  return next;
}

MarchingCubesTable derive() {
  MarchingCubesTable table{};
  int e = 0;
  for (std::uint8_t axis = 0; axis < 3; ++axis)
    for (std::uint8_t corner = 0; corner < 8; ++corner)
      if (!(corner & (4 >> axis))) table.edges[static_cast<std::size_t>(e++)] = {corner, axis};
  for (int solid = 0; solid < 256; ++solid) {
    std::array<int, kCellEdges> next = next_edges(table, solid);
    for (int start = 0; start < kCellEdges; ++start) {
      std::vector<std::uint8_t> loop;
      for (int at = start; next[static_cast<std::size_t>(at)] >= 0;) {
        loop.push_back(static_cast<std::uint8_t>(at));
        at = std::exchange(next[static_cast<std::size_t>(at)], -1);
      }
      CellCase& cell = table.cases[static_cast<std::size_t>(solid)];
      for (std::size_t i = 2; i < loop.size(); ++i)
        for (const std::uint8_t edge : {loop[0], loop[i - 1], loop[i]}) {
          OSTEON_CHECK(cell.corners < cell.edges.size());
          cell.edges[cell.corners++] = edge;
        }
    }
  }
  return table;
}

}  // namespace

const MarchingCubesTable& marching_cubes_table() {
  static const MarchingCubesTable table = derive();
  return table;
}

}  // namespace osteon
