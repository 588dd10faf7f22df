// Rigid transforms. `pose_bone_tool` is the tool seen from the bone. It maps tool coordinates to bone coordinates.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace osteon {

using Vec3 = Eigen::Vector3d;  // millimetres unless the name says otherwise

struct Pose {
  Vec3 position_mm = Vec3::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();

  [[nodiscard]] Vec3 point(const Vec3& p) const { return rotation * p + position_mm; }
  [[nodiscard]] Vec3 direction(const Vec3& v) const { return rotation * v; }
  [[nodiscard]] Pose inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {-(back * position_mm), back};
  }
  friend Pose operator*(const Pose& a, const Pose& b) {
    return {a.point(b.position_mm), (a.rotation * b.rotation).normalized()};
  }
};

// The shortest rotation from one direction to another, both non-zero vectors. Files call this instead of Eigen's
// template, because each file that uses the template compiles a singular value decomposition, which takes ten seconds.
[[nodiscard]] Eigen::Quaterniond rotation_between(const Vec3& from, const Vec3& to);

// The tool's pose with its tip at `tip_mm` and its +z axis (out of the tip) along `axis`, a non-zero vector.
[[nodiscard]] Pose pose_along(const Vec3& tip_mm, const Vec3& axis);

}  // namespace osteon
