// Maps the pose of the device's handle to the pose of the tool. The mapping is aligned with the view, scaled, and
// re-anchored by the clutch, so that a small device reaches a large bone. Device frame: x right, y up, z towards the
// user. Bone frame: the patient's.
#pragma once
#include "common/geometry/pose.hpp"

namespace osteon::haptic {

class WorkspaceMapping {
 public:
  // `view`: rotation from the device's (and screen's) frame to the bone's; `scale`: bone mm for each device mm.
  void align(const Eigen::Quaterniond& view, double scale, const Vec3& device_mm, const Vec3& bone_mm) noexcept {
    view_ = view;
    scale_ = scale;
    anchor(device_mm, bone_mm);
  }
  // From now on this position of the device is that position in the bone's frame. Releasing the clutch calls this.
  void anchor(const Vec3& device_mm, const Vec3& bone_mm) noexcept {
    device_mm_ = device_mm;
    bone_mm_ = bone_mm;
  }

  [[nodiscard]] Pose pose_bone_tool(const Pose& pose_device_tool) const noexcept {
    return {bone_mm_ + scale_ * (view_ * (pose_device_tool.position_mm - device_mm_)),
            (view_ * pose_device_tool.rotation).normalized()};
  }
  [[nodiscard]] Pose pose_device_tool(const Pose& pose_bone_tool) const noexcept {
    const Eigen::Quaterniond back = view_.conjugate();
    return {device_mm_ + back * (pose_bone_tool.position_mm - bone_mm_) / scale_,
            (back * pose_bone_tool.rotation).normalized()};
  }
  // For directions and forces: these are rotated but not scaled.
  [[nodiscard]] Vec3 to_device(const Vec3& bone) const noexcept { return view_.conjugate() * bone; }
  [[nodiscard]] Vec3 to_bone(const Vec3& device) const noexcept { return view_ * device; }
  [[nodiscard]] double scale() const noexcept { return scale_; }
  // The parameters of the mapping: align() with these gives the same mapping to the last bit.
  [[nodiscard]] const Eigen::Quaterniond& view() const noexcept { return view_; }
  [[nodiscard]] const Vec3& device_mm() const noexcept { return device_mm_; }
  [[nodiscard]] const Vec3& bone_mm() const noexcept { return bone_mm_; }

 private:
  Eigen::Quaterniond view_ = Eigen::Quaterniond::Identity();
  double scale_ = 1.0;
  Vec3 device_mm_ = Vec3::Zero(), bone_mm_ = Vec3::Zero();
};

}  // namespace osteon::haptic
