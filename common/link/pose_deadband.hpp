// Whether a tool has moved enough to say so: what is too small to see or feel is not sent again.
#pragma once
#include <cmath>
#include <numbers>

#include "common/geometry/pose.hpp"

namespace osteon {

struct PoseDeadband {
  double position_mm = 0.02;
  double rotation_rad = 0.1 * std::numbers::pi / 180.0;
};

// `said`: the pose that was sent last.
[[nodiscard]] inline bool has_moved(const Pose& said, const Pose& now, const PoseDeadband& band = {}) {
  // The quaternion between the two has a vector part of sin(half the angle); q and -q are one rotation.
  const double half_sine = (said.rotation.conjugate() * now.rotation).vec().norm();
  return (now.position_mm - said.position_mm).norm() > band.position_mm ||
         half_sine > std::sin(band.rotation_rad / 2.0);
}

}  // namespace osteon
