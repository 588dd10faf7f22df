// A surface of triangles with shared vertices, and what one asks of a solid's surface.
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
  std::vector<std::array<float, 3>> normals;            // one for each position, or none at all
};

// Edges whose two sides are not one triangle each, of opposite direction: none on the closed surface of a solid.
[[nodiscard]] std::size_t open_edges(const TriangleMesh& mesh);
// By Gauss's theorem: positive when the triangles of a closed surface turn outwards.
[[nodiscard]] double enclosed_mm3(const TriangleMesh& mesh);
[[nodiscard]] double area_mm2(const TriangleMesh& mesh);
[[nodiscard]] Box bounds(const TriangleMesh& mesh);
[[nodiscard]] inline Vec3 position(const TriangleMesh& mesh, std::uint32_t vertex) {
  const auto& p = mesh.positions_mm[vertex];
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

}  // namespace osteon
