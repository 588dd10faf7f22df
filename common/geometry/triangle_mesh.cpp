#include "common/geometry/triangle_mesh.hpp"

#include "common/geometry/mesh_edges.hpp"

namespace osteon {

std::size_t open_edges(const TriangleMesh& mesh) { return edge_faults(mesh).open; }

double enclosed_mm3(const TriangleMesh& mesh) {
  if (mesh.positions_mm.empty()) return 0.0;
  // Relative to a point of the surface, because large terms far from it would cancel.
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
