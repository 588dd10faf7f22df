// A line that the user draws freehand on the bone.
#pragma once
#include <cstddef>
#include <vector>

#include "common/geometry/pose.hpp"

namespace osteon {

// A line through some of the points, including both ends. No point is farther from the line than `tolerance_mm`
// (Douglas and Peucker 1973).
[[nodiscard]] std::vector<Vec3> simplified(const std::vector<Vec3>& points, double tolerance_mm);

class Stroke {
 public:
  static constexpr double kApart_mm = 1.0;

  // The pen's position. A point nearer than kApart_mm to the one before is added only at the end.
  void add(const Vec3& point_mm);
  // At most `most` points, including the last one. Empty if the pen has not moved.
  [[nodiscard]] std::vector<Vec3> line(std::size_t most) const;

 private:
  std::vector<Vec3> points_;
  Vec3 last_ = Vec3::Zero();
};

}  // namespace osteon
