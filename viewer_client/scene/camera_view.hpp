// The camera's pose as pure geometry, bone frame.
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

// What a window of this size shows of the view.
[[nodiscard]] ViewFrustum look_of(const CameraView& view, int width_px, int height_px);

// The view of another person. If they do not name an up direction, up is towards the head, or towards the face if they
// look along the body. A ViewFrustum does not contain the picture's height, so the vertical angle is taken from `now`,
// this window's own view.
[[nodiscard]] CameraView looking_as(const ViewFrustum& look, const CameraView& now);

// A ray from the eye through a pixel, bone frame; the direction is a unit vector. Columns from the left, rows from the
// top; the pixel's middle.
struct SightRay {
  Vec3 from_mm, direction;
};
[[nodiscard]] SightRay ray_through(const CameraView& view, int width_px, int height_px, int x_px, int y_px);

// The view turned about its target, as by dragging the bone: radians about the picture's vertical and horizontal axis.
[[nodiscard]] CameraView orbited(const CameraView& view, double right_rad, double up_rad);
// The view moved aside by fractions of the picture's height, so that what is dragged stays under the pointer.
[[nodiscard]] CameraView shifted(const CameraView& view, double right, double up);
// The view at `factor` times the distance from its target.
[[nodiscard]] CameraView zoomed(const CameraView& view, double factor);

// The whole bone from the front, from its left and slightly above (DICOM LPS: +x left, -y front, +z up).
[[nodiscard]] CameraView overview(const Box& bone);
// The same direction, from where the whole box fits into a picture of this shape, with a margin of a twentieth.
[[nodiscard]] CameraView fitted(const CameraView& view, const Box& bone, double width_over_height);

// Looks at the tool's tip from a distance of `distance_mm`. The camera is behind the tool and beside its axis, so that
// the shank does not hide the hole.
[[nodiscard]] CameraView beside_tool(const Pose& pose_bone_tool, double distance_mm);

// The view after a SpaceMouse cap was pushed and twisted for dt_s. Push and twist are fractions −1 … 1 of the full
// deflection, in the viewer's axes: x right, y up, z to the eye. The bone follows the cap, so the camera moves the
// other way. The nearer the camera, the slower it moves.
[[nodiscard]] CameraView held_by_cap(const CameraView& view, const Vec3& push, const Vec3& twist, double dt_s);

}  // namespace osteon
