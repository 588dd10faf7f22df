// The part of the bone that is drawn: what lies on the inner side of all planes. Nothing is cut.
#pragma once
#include <algorithm>
#include <vector>

#include "common/geometry/pose.hpp"

namespace osteon {

// Bone frame, mm. What lies on the side that the unit normal points to is drawn.
struct ClipPlane {
  Vec3 point_mm = Vec3::Zero();
  Vec3 inward = Vec3::UnitZ();
};

using Clipping = std::vector<ClipPlane>;

[[nodiscard]] inline bool is_drawn(const Clipping& clipping, const Vec3& point_mm) {
  return std::ranges::all_of(
      clipping, [&](const ClipPlane& plane) { return (point_mm - plane.point_mm).dot(plane.inward) >= 0.0; });
}

}  // namespace osteon
