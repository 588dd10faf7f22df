#include "common/geometry/triangle_mesh.hpp"

#include <algorithm>
#include <utility>

namespace osteon {

std::size_t open_edges(const TriangleMesh& mesh) {
  // (lower vertex, upper vertex) and the direction in which a triangle runs along it.
  std::vector<std::pair<std::uint64_t, int>> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = t[k], b = t[(k + 1) % 3];
      edges.emplace_back(std::min(a, b) << 32 | std::max(a, b), a < b ? 1 : -1);
    }
  std::ranges::sort(edges);
  std::size_t open = 0;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i;
    int balance = 0;
    for (; end < edges.size() && edges[end].first == edges[i].first; ++end) balance += edges[end].second;
    // Two solids may touch in an edge, which then has four sides that balance.
    if (balance != 0) ++open;
    i = end;
  }
  return open;
}

double enclosed_mm3(const TriangleMesh& mesh) {
  if (mesh.positions_mm.empty()) return 0.0;
  // About a point of the surface: far from it large terms would cancel.
  const Vec3 origin = position(mesh, 0);
  double six_volumes = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    six_volumes += (position(mesh, a) - origin).dot((position(mesh, b) - origin).cross(position(mesh, c) - origin));
  return six_volumes / 6.0;
}

double area_mm2(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    area += 0.5 * (position(mesh, b) - position(mesh, a)).cross(position(mesh, c) - position(mesh, a)).norm();
  return area;
}

Box bounds(const TriangleMesh& mesh) {
  Box box;
  for (std::uint32_t i = 0; i < mesh.positions_mm.size(); ++i) box.include(position(mesh, i));
  return box;
}

}  // namespace osteon
