// A line that is drawn by hand on the bone, and points as annotations keep them.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/geometry/pose.hpp"

namespace osteon {

// Bone frame, in steps of 2^-10 mm, as an Annotation has them. Beyond 2^30 steps: the nearest of these.
[[nodiscard]] std::array<std::int32_t, 3> in_steps(const Vec3& point_mm);
[[nodiscard]] Vec3 from_steps(const std::array<std::int32_t, 3>& point);

// The line through some of the points, its ends among them, that passes no point at more than `tolerance_mm`
// (Douglas and Peucker 1973).
[[nodiscard]] std::vector<Vec3> simplified(const std::vector<Vec3>& points, double tolerance_mm);

class Stroke {
 public:
  static constexpr double kApart_mm = 1.0;

  // Where the hand draws now; what is nearer than kApart_mm to the point before waits for the end.
  void add(const Vec3& point_mm);
  // At most `most` points, the last one among them; empty where the hand has not moved.
  [[nodiscard]] std::vector<Vec3> line(std::size_t most) const;

 private:
  std::vector<Vec3> points_;
  Vec3 last_ = Vec3::Zero();
};

}  // namespace osteon
