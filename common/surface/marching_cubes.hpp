// Marching cubes: which edges of a cell the surface crosses, and the triangles between them. Lorensen 1987. The table
// is computed here, not written by hand.
#pragma once
#include <array>
#include <cstdint>

namespace osteon {

// Corner i of a cell lies at (i >> 2 & 1, i >> 1 & 1, i & 1). A case has bit i set if corner i is solid.
struct CellEdge {
  std::uint8_t corner;  // the end with the smaller coordinates
  std::uint8_t axis;    // 0, 1, 2: towards +x, +y, +z
};
inline constexpr int kCellEdges = 12;
inline constexpr int kCaseTriangles = 5;  // no case has more

// Triangles of a case as edge numbers, three for each triangle, counter-clockwise seen from outside the solid.
struct CellCase {
  std::uint8_t corners = 0;  // three for each triangle
  std::array<std::uint8_t, 3 * kCaseTriangles> edges{};
};

struct MarchingCubesTable {
  std::array<CellEdge, kCellEdges> edges;
  // On a face with two diagonally opposite solid corners, the surface separates them. The rule depends only on the
  // face, so neighbours agree.
  std::array<CellCase, 256> cases;
};

[[nodiscard]] const MarchingCubesTable& marching_cubes_table();

}  // namespace osteon
