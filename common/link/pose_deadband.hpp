// Whether a tool has moved enough to send its pose again. Motion too small to see or feel is not sent.
#pragma once
#include <cmath>
#include <numbers>

#include "common/geometry/pose.hpp"

namespace osteon {

struct PoseDeadband {
  double position_mm = 0.02;
  double rotation_rad = 0.1 * std::numbers::pi / 180.0;
};

// `said`: the last pose that was sent.
[[nodiscard]] inline bool has_moved(const Pose& said, const Pose& now, const PoseDeadband& band = {}) {
  // The quaternion between the two poses has a vector part of sin(half the angle). q and -q are the same rotation.
  const double half_sine = (said.rotation.conjugate() * now.rotation).vec().norm();
  return (now.position_mm - said.position_mm).norm() > band.position_mm ||
         half_sine > std::sin(band.rotation_rad / 2.0);
}

}  // namespace osteon
