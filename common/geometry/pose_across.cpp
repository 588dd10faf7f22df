#include "common/geometry/pose_across.hpp"

#include "common/core/check.hpp"

namespace osteon {

Pose pose_across(const Vec3& tip_mm, const Vec3& axis, const Vec3& across) {
  const Vec3 z = axis.normalized();
  const Vec3 x = (across - across.dot(z) * z).normalized();
  OSTEON_CHECK(x.allFinite() && z.allFinite());
  Eigen::Matrix3d turn;
  turn << x, z.cross(x), z;
  return {tip_mm, Eigen::Quaterniond(turn)};
}

}  // namespace osteon
