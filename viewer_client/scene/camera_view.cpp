#include "viewer_client/scene/camera_view.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {

namespace {

constexpr double kLeastSight_mm = 1e-6;  // below this distance there is no direction of view

// The unit vector of the direction's part across `axis`. `otherwise` if the direction runs along the axis.
Vec3 across(const Vec3& direction, const Vec3& axis, const Vec3& otherwise) {
  const Vec3 part = direction - direction.dot(axis) * axis;
  return part.norm() > 0.1 * direction.norm() ? part.normalized() : otherwise;
}

}  // namespace

ViewFrustum look_of(const CameraView& view, int width_px, int height_px) {
  const double half_height = std::tan(0.5 * view.view_angle_rad);
  const double shape = static_cast<double>(width_px) / height_px;
  ViewFrustum look{view.eye_mm, view.target_mm, 2.0 * half_height / height_px,
                   std::atan(half_height * std::hypot(1.0, shape))};
  const Vec3 sight = view.target_mm - view.eye_mm;
  const Vec3 up =
      sight.norm() > kLeastSight_mm ? across(view.up, sight.normalized(), Vec3::Zero()) : Vec3(Vec3::Zero());
  if (up != Vec3::Zero()) look.up = up;
  return look;
}

CameraView looking_as(const ViewFrustum& look, const CameraView& now) {
  const Vec3 sight = look.target_mm - look.eye_mm;
  if (!(sight.norm() > kLeastSight_mm)) return now;
  CameraView view = now;
  view.eye_mm = look.eye_mm;
  view.target_mm = look.target_mm;
  view.up = across(Vec3::UnitZ(), sight.normalized(), across(-Vec3::UnitY(), sight.normalized(), Vec3::UnitX()));
  if (look.up) view.up = across(*look.up, sight.normalized(), view.up);
  return view;
}

namespace {

// Columns: right, up and to the eye, in the bone's frame. `back`: from the target to the eye, not zero.
Eigen::Matrix3d picture_axes(const CameraView& view, const Vec3& back) {
  Eigen::Matrix3d seen;
  seen.col(2) = back.normalized();
  seen.col(1) = across(view.up, seen.col(2), across(Vec3::UnitZ(), seen.col(2), Vec3::UnitX()));
  seen.col(0) = seen.col(1).cross(seen.col(2));
  return seen;
}

}  // namespace

SightRay ray_through(const CameraView& view, int width_px, int height_px, int x_px, int y_px) {
  const Vec3 back = view.eye_mm - view.target_mm;
  if (!(back.norm() > kLeastSight_mm)) return {view.eye_mm, Vec3::UnitY()};
  const double per_px = 2.0 * std::tan(0.5 * view.view_angle_rad) / height_px;
  const Vec3 seen(per_px * (x_px + 0.5 - 0.5 * width_px), per_px * (0.5 * height_px - y_px - 0.5), -1.0);
  return {view.eye_mm, (picture_axes(view, back) * seen).normalized()};
}

CameraView orbited(const CameraView& view, double right_rad, double up_rad) {
  const Vec3 back = view.eye_mm - view.target_mm;
  if (!(back.norm() > kLeastSight_mm)) return view;
  const Eigen::Matrix3d seen = picture_axes(view, back);
  const Eigen::Quaterniond turn =
      Eigen::AngleAxisd(-right_rad, Vec3(seen.col(1))) * Eigen::AngleAxisd(up_rad, Vec3(seen.col(0)));
  CameraView turned = view;
  turned.eye_mm = view.target_mm + turn * back;
  turned.up = turn * Vec3(seen.col(1));
  return turned;
}

CameraView shifted(const CameraView& view, double right, double up) {
  const Vec3 back = view.eye_mm - view.target_mm;
  if (!(back.norm() > kLeastSight_mm)) return view;
  const double height_mm = 2.0 * std::tan(0.5 * view.view_angle_rad) * back.norm();
  const Vec3 aside = picture_axes(view, back) * Vec3(-right * height_mm, -up * height_mm, 0.0);
  CameraView moved = view;
  moved.eye_mm += aside;
  moved.target_mm += aside;
  return moved;
}

CameraView zoomed(const CameraView& view, double factor) {
  CameraView nearer = view;
  nearer.eye_mm = view.target_mm + factor * (view.eye_mm - view.target_mm);
  return nearer;
}

CameraView overview(const Box& bone) {
  CameraView view;
  view.target_mm = 0.5 * (bone.min_mm + bone.max_mm);
  // The sphere round the box fits into the vertical angle. Bones are seldom boxes, so the camera comes slightly closer.
  const double radius_mm = 0.5 * (bone.max_mm - bone.min_mm).norm();
  const double distance_mm = 0.72 * radius_mm / std::sin(0.5 * view.view_angle_rad);
  const Vec3 towards_eye = Vec3(0.62, -0.72, 0.30).normalized();
  view.eye_mm = view.target_mm + distance_mm * towards_eye;
  view.up = Vec3::UnitZ();
  return view;
}

CameraView fitted(const CameraView& view, const Box& bone, double width_over_height) {
  constexpr double kMargin = 1.05;
  const Vec3 back = view.eye_mm - view.target_mm;
  if (!(back.norm() > kLeastSight_mm)) return view;
  const Eigen::Matrix3d seen = picture_axes(view, back);
  const double half_height = std::tan(0.5 * view.view_angle_rad) / kMargin;  // of the picture, at a distance of 1
  CameraView fits = view;
  fits.target_mm = 0.5 * (bone.min_mm + bone.max_mm);
  double distance_mm = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p = bone.min_mm;
    for (int axis = 0; axis < 3; ++axis)
      if ((corner >> axis & 1) != 0) p[axis] = bone.max_mm[axis];
    const Vec3 at = seen.transpose() * (p - fits.target_mm);
    const double aside = std::max(std::abs(at.x()) / width_over_height, std::abs(at.y()));
    distance_mm = std::max(distance_mm, at.z() + aside / half_height);
  }
  fits.eye_mm = fits.target_mm + std::max(distance_mm, kLeastSight_mm) * Vec3(seen.col(2));
  return fits;
}

CameraView beside_tool(const Pose& pose_bone_tool, double distance_mm) {
  const Vec3 back = -pose_bone_tool.direction(Vec3::UnitZ());
  // Towards the patient's front if the axis allows it, because the overview looks from there.
  const Vec3 aside = across(-Vec3::UnitY(), back, across(Vec3::UnitX(), back, Vec3::UnitX()));
  const double off_axis_rad = 0.66;
  CameraView view;
  view.target_mm = pose_bone_tool.position_mm;
  view.eye_mm = view.target_mm + distance_mm * (std::cos(off_axis_rad) * back + std::sin(off_axis_rad) * aside);
  const Vec3 sight = (view.target_mm - view.eye_mm).normalized();
  view.up = across(Vec3::UnitZ(), sight, across(back, sight, Vec3::UnitX()));
  return view;
}

CameraView held_by_cap(const CameraView& view, const Vec3& push, const Vec3& twist, double dt_s) {
  constexpr double kDistancesPerSecond = 0.5, kNearerPerSecond = 0.8, kRadPerSecond = 1.2;  // [A]
  const Vec3 back = view.eye_mm - view.target_mm;
  const double distance_mm = back.norm();
  if (!(distance_mm > 0.0)) return view;
  const Eigen::Matrix3d seen = picture_axes(view, back);

  CameraView moved = view;
  const double angle = kRadPerSecond * dt_s * twist.norm();
  const Eigen::AngleAxisd turn(-angle, angle > 0.0 ? Vec3(seen * twist.normalized()) : Vec3(Vec3::UnitX()));
  const Vec3 aside = -kDistancesPerSecond * dt_s * distance_mm * (seen * Vec3(push.x(), push.y(), 0.0));
  const double nearer = std::exp(-kNearerPerSecond * dt_s * push.z());
  moved.target_mm = view.target_mm + aside;
  moved.eye_mm = moved.target_mm + turn * (nearer * back);
  moved.up = turn * Vec3(seen.col(1));
  return moved;
}

}  // namespace osteon
