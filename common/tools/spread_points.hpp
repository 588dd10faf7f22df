// Spreads points evenly over the surface of any implicit solid, without gaps or crowded regions.
#pragma once
#include <functional>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"
#include "common/tools/implicit.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// At least `count` points. If `count` is 0, as many as this spacing gives (at least one).
struct Spread {
  int count = 0;
  double spacing_mm = 0;
};

// Points on the part of `surface` (a mesh of `solid`) for which belongs(point, outward) holds, moved from there onto
// the solid itself. Candidates are dense and distributed by area. A candidate is kept if no kept one is nearer than a
// radius, which shrinks until there are enough. So kept points are at least that far apart, and no surface point is
// farther from one than the radius plus the candidates' spacing. Opposite sides of a thin plate do not count as near.
// The area of each candidate counts for its nearest point, and the areas add up to that of the part. No point is on an
// edge. Passive; deterministic.
[[nodiscard]] std::vector<SamplePoint> spread_points(
    const Implicit& solid, const TriangleMesh& surface,
    const std::function<bool(const Vec3& p, const Vec3& outward)>& belongs, const Spread& spread);

// Those of sample_points(tool, count) that are active, in their order. A long tool takes a fraction of the time. The
// tool cuts.
[[nodiscard]] std::vector<SamplePoint> active_points(const Tool& tool, int count);

}  // namespace osteon
