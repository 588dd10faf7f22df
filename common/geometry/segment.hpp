// Distance to a straight line between two points.
#pragma once
#include <algorithm>

#include "common/geometry/pose.hpp"

namespace osteon {

[[nodiscard]] inline double segment_distance_mm(const Vec3& p, const Vec3& a, const Vec3& b) noexcept {
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

}  // namespace osteon
