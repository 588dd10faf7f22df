// Where one looks from: pure geometry, bone frame.
#pragma once
#include "common/geometry/lattice.hpp"
#include "common/geometry/pose.hpp"
#include "common/surface/view_frustum.hpp"

namespace osteon {

struct CameraView {
  Vec3 eye_mm = Vec3(0.0, -1.0, 0.0);
  Vec3 target_mm = Vec3::Zero();
  Vec3 up = Vec3::UnitZ();
  double view_angle_rad = 0.5236;  // full vertical angle
};

// What a window of this size shows of it.
[[nodiscard]] ViewFrustum look_of(const CameraView& view, int width_px, int height_px);

// As somebody else looks. Where they do not say which way is up, the head is, or the face where one looks along the
// body. A ViewFrustum has no picture's height: the angle stays that of `now`, this window's own view.
[[nodiscard]] CameraView looking_as(const ViewFrustum& look, const CameraView& now);

// The whole bone from the front, its left and a little above (DICOM LPS: +x left, -y front, +z up).
[[nodiscard]] CameraView overview(const Box& bone);

// The tool's tip from `distance_mm`, from behind the tool and aside of its axis, so that the shank does not hide the
// hole.
[[nodiscard]] CameraView beside_tool(const Pose& pose_bone_tool, double distance_mm);

// The view after the bone was held for a while by a cap that is pushed and twisted, parts of the whole way −1 … 1 in
// what one sees: x right, y up, z to the eye. The bone follows the cap, so the camera goes the other way; the nearer,
// the slower.
[[nodiscard]] CameraView held_by_cap(const CameraView& view, const Vec3& push, const Vec3& twist, double dt_s);

}  // namespace osteon
