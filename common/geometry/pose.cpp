#include "common/geometry/pose.hpp"

namespace osteon {

Pose pose_along(const Vec3& tip_mm, const Vec3& axis) {
  return {tip_mm, Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), axis).normalized()};
}

}  // namespace osteon
