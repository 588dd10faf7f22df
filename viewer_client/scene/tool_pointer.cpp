#include "viewer_client/scene/tool_pointer.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {

namespace {

// The normal is a mean over a disc of this radius, so that a single triangle does not tilt the tool.
constexpr double kNormalRadius_mm = 2.5;
// A ray nearly along the plane of motion would throw the tool far away.
constexpr double kLeastSlope = 0.05, kFarthest_mm = 200.0;

}  // namespace

void ToolPointer::take(const std::string& tool) {
  input_.tool = tool;
  input_.push = false;
  input_.spindle_rpm = 0.0;
  turn_.setIdentity();
  roll_rad_ = 0.0;
  aim();
}

void ToolPointer::move(const SightRay& ray, const SurfaceScene& surface) {
  if (input_.push) {
    const Vec3 axis = input_.rotation_bone_tool * Vec3::UnitZ();
    const double slope = ray.direction.dot(axis);
    if (std::abs(slope) < kLeastSlope) return;
    const double distance = (input_.target_mm - ray.from_mm).dot(axis) / slope;
    const Vec3 at = ray.from_mm + distance * ray.direction;
    if (distance > 0.0 && (at - input_.target_mm).norm() < kFarthest_mm) input_.target_mm = at;
    return;
  }
  hit_ = surface.first_hit(ray.from_mm, ray.direction);
  input_.on_bone = hit_.has_value();
  if (!hit_) return;
  input_.target_mm = hit_->point_mm;
  normal_ = surface.mean_normal(hit_->point_mm, kNormalRadius_mm).value_or(hit_->normal);
  // In a narrow hole the mean may look away from the eye. Then the triangle itself decides.
  if (normal_.dot(ray.direction) > 0.0) normal_ = hit_->normal;
  aim();
}

void ToolPointer::leave() {
  if (!input_.push) input_.on_bone = false;
}

bool ToolPointer::press() {
  if (!input_.on_bone || input_.tool.empty()) return false;
  input_.push = true;
  return true;
}

void ToolPointer::release() { input_.push = false; }

void ToolPointer::turn(const CameraView& view, double right_rad, double up_rad) {
  const Vec3 back = view.eye_mm - view.target_mm;
  const Vec3 right = view.up.cross(back);
  if (!(right.norm() > 0.0)) return;
  const Vec3 x = right.normalized(), y = back.cross(right).normalized();
  turn_ = (Eigen::AngleAxisd(right_rad, y) * Eigen::AngleAxisd(-up_rad, x) * turn_).normalized();
  aim();
}

void ToolPointer::twist(const CameraView& view, const Vec3& twist_rad) {
  const Vec3 back = view.eye_mm - view.target_mm;
  const Vec3 right = view.up.cross(back);
  if (!(right.norm() > 0.0) || twist_rad.isZero()) return;
  const Vec3 about = twist_rad.x() * right.normalized() + twist_rad.y() * back.cross(right).normalized() +
                     twist_rad.z() * back.normalized();
  // The part about the tool's own axis only rolls it.
  const Vec3 axis = input_.rotation_bone_tool * Vec3::UnitZ();
  const Vec3 tilt = about - about.dot(axis) * axis;
  const double angle = tilt.norm();
  roll_rad_ += about.dot(axis);
  if (angle > 0.0) turn_ = (Eigen::AngleAxisd(angle, tilt / angle) * turn_).normalized();
  aim();
}

void ToolPointer::roll(double angle_rad) {
  roll_rad_ += angle_rad;
  aim();
}

void ToolPointer::add_push(double newtons) { set_push(input_.push_n + newtons); }

void ToolPointer::set_push(double newtons) { input_.push_n = std::clamp(newtons, kLeastPush_n, kMostPush_n); }

const PointerInput& ToolPointer::input() {
  input_.spindle = spindle_ ? 1.0 : 0.0;
  return input_;
}

void ToolPointer::aim() {
  const Pose pose = pose_along(Vec3::Zero(), turn_ * -normal_);
  input_.rotation_bone_tool = (pose.rotation * Eigen::AngleAxisd(roll_rad_, Vec3::UnitZ())).normalized();
}

}  // namespace osteon
