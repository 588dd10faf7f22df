// Points spread evenly over the surface of any implicit solid: nowhere two too near, nowhere a bare patch.
#pragma once
#include <functional>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"
#include "common/tools/implicit.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// At least `count` points, or if that is 0, as many as this spacing gives (at least one).
struct Spread {
  int count = 0;
  double spacing_mm = 0;
};

// On the part of `surface` (a mesh of `solid`) for which belongs(point, outward) holds, and moved from there onto the
// solid itself. Candidates lie densely by area; one is kept when no kept one is nearer than a radius, which shrinks
// until there are enough. So kept points are at least that far apart, and no place is farther from one than that and
// the candidates' own spacing. Opposite sides of a thin plate do not count as near. The areas of the points, each
// candidate's to its nearest, add up to that part's. No point is on an edge. Passive; deterministic.
[[nodiscard]] std::vector<SamplePoint> spread_points(
    const Implicit& solid, const TriangleMesh& surface,
    const std::function<bool(const Vec3& p, const Vec3& outward)>& belongs, const Spread& spread);

}  // namespace osteon
