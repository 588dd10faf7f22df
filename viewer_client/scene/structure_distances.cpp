#include "viewer_client/scene/structure_distances.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "common/geometry/triangle_distance.hpp"

namespace osteon {

namespace {

// The triangles of a surface are in the order of slices and rows, so those that follow each other are neighbours.
constexpr std::size_t kGroup = 32;

std::array<Vec3, 3> corners_of(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return {position(mesh, a), position(mesh, b), position(mesh, c)};
}

// Squared distance; 0 inside the box.
double squared_to(const Box& box, const Vec3& p) {
  return (box.min_mm - p).cwiseMax(p - box.max_mm).cwiseMax(0.0).squaredNorm();
}

// The point of a triangle that is nearest to p, by the part of it that the distance is to.
Vec3 nearest_point(const Vec3& p, const std::array<Vec3, 3>& at, unsigned corners) {
  std::vector<Vec3> of;
  for (unsigned i = 0; i < 3; ++i)
    if (corners >> i & 1) of.push_back(at[i]);
  if (of.size() == 1) return of[0];
  if (of.size() == 2) {
    const Vec3 along = of[1] - of[0];
    const double length = along.squaredNorm();
    return length > 0.0 ? Vec3(of[0] + std::clamp(along.dot(p - of[0]) / length, 0.0, 1.0) * along) : of[0];
  }
  const Vec3 normal = (at[1] - at[0]).cross(at[2] - at[0]);
  const double size = normal.squaredNorm();
  return size > 0.0 ? Vec3(p - normal * (normal.dot(p - at[0]) / size)) : at[0];
}

}  // namespace

StructureDistances::StructureDistances(std::shared_ptr<const SurgicalPlan> plan) : plan_(std::move(plan)) {
  for (std::size_t s = 0; s < plan_->structures.size(); ++s) {
    if (!plan_->structures[s].at_risk()) continue;
    const TriangleMesh& mesh = plan_->structures[s].surface;
    AtRisk& at_risk = at_risk_.emplace_back(AtRisk{s, {}, {}});
    for (std::size_t first = 0; first < mesh.triangles.size(); first += kGroup) {
      Group group{first, std::min(first + kGroup, mesh.triangles.size()), {}};
      for (std::size_t i = group.first; i < group.last; ++i)
        for (const Vec3& corner : corners_of(mesh, i)) group.box.include(corner);
      at_risk.box.include(group.box.min_mm);
      at_risk.box.include(group.box.max_mm);
      at_risk.groups.push_back(group);
    }
  }
}

// Whether a line to one side leaves the closed surface an odd number of times. The line is a little aside, so that it
// meets no edge of triangles whose corners lie on lattice lines.
bool StructureDistances::is_inside(const Vec3& point_mm, const AtRisk& at_risk) const {
  if (squared_to(at_risk.box, point_mm) > 0.0) return false;
  const Vec3 from = point_mm + Vec3(0.0, 1.2345e-5, 2.3456e-5);
  const TriangleMesh& mesh = plan_->structures[at_risk.structure].surface;
  bool inside = false;
  for (const Group& group : at_risk.groups) {
    if (from.x() > group.box.max_mm.x() || from.y() < group.box.min_mm.y() || from.y() > group.box.max_mm.y() ||
        from.z() < group.box.min_mm.z() || from.z() > group.box.max_mm.z())
      continue;
    for (std::size_t i = group.first; i < group.last; ++i) {
      const auto at = corners_of(mesh, i);
      // Seen along x: on one side of all three edges.
      const auto side = [&](const Vec3& a, const Vec3& b) {
        return (b.y() - a.y()) * (from.z() - a.z()) - (b.z() - a.z()) * (from.y() - a.y());
      };
      const double u = side(at[1], at[2]), v = side(at[2], at[0]), w = side(at[0], at[1]), sum = u + v + w;
      if (sum == 0.0 || u / sum < 0.0 || v / sum < 0.0 || w / sum < 0.0) continue;
      if ((u * at[0].x() + v * at[1].x() + w * at[2].x()) / sum > from.x()) inside = !inside;
    }
  }
  return inside;
}

std::optional<NearestStructure> StructureDistances::nearest(const Vec3& point_mm) const {
  double least = std::numeric_limits<double>::infinity();
  std::optional<NearestStructure> found;
  // A structure around the point is nearer than all others.
  for (const AtRisk& at_risk : at_risk_)
    if (is_inside(point_mm, at_risk)) found = NearestStructure{at_risk.structure, 0.0, true, point_mm};
  for (const AtRisk& at_risk : at_risk_) {
    if ((found && found->inside && at_risk.structure != found->structure) || squared_to(at_risk.box, point_mm) >= least)
      continue;
    const TriangleMesh& mesh = plan_->structures[at_risk.structure].surface;
    for (const Group& group : at_risk.groups) {
      if (squared_to(group.box, point_mm) >= least) continue;
      for (std::size_t i = group.first; i < group.last; ++i) {
        const auto at = corners_of(mesh, i);
        const auto [squared, corners] = distance_to_triangle<double>(point_mm, at[0], at[1], at[2]);
        if (squared >= least) continue;
        least = squared;
        const bool inside = found && found->inside;
        found = NearestStructure{at_risk.structure, inside ? 0.0 : std::sqrt(squared), inside,
                                 nearest_point(point_mm, at, corners)};
      }
    }
  }
  return found;
}

}  // namespace osteon
