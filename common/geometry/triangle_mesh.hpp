// A surface of triangles with shared vertices, and properties of a solid's surface.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/geometry/lattice.hpp"

namespace osteon {

struct TriangleMesh {
  std::vector<std::array<float, 3>> positions_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise seen from outside
  std::vector<std::array<float, 3>> normals;            // one for each position, or none
};

// Edges that do not belong to exactly one triangle in each direction. The closed surface of a solid has none.
[[nodiscard]] std::size_t open_edges(const TriangleMesh& mesh);
// By Gauss's theorem. Positive if the triangles of a closed surface are oriented outwards.
[[nodiscard]] double enclosed_mm3(const TriangleMesh& mesh);
[[nodiscard]] double area_mm2(const TriangleMesh& mesh);
[[nodiscard]] Box bounds(const TriangleMesh& mesh);
[[nodiscard]] inline Vec3 position(const TriangleMesh& mesh, std::uint32_t vertex) {
  const auto& p = mesh.positions_mm[vertex];
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

}  // namespace osteon
