#include "common/geometry/pose.hpp"

namespace osteon {

Eigen::Quaterniond rotation_between(const Vec3& from, const Vec3& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

Pose pose_along(const Vec3& tip_mm, const Vec3& axis) {
  return {tip_mm, rotation_between(Vec3::UnitZ(), axis).normalized()};
}

}  // namespace osteon
