#include "viewer_client/scene/tool_pointer.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {

namespace {

// The normal is a mean over a disc of this radius, so that a single triangle does not tilt the tool.
constexpr double kNormalRadius_mm = 2.5;
// A ray nearly along the plane of motion would throw the tool far away.
constexpr double kLeastSlope = 0.05, kFarthest_mm = 200.0;
// A stick's fastest: heights of the picture a second. A hand that pushes follows slowly.
constexpr double kSlide_per_s = 0.4, kSlidePushing_mm_per_s = 20.0;
constexpr double kGap_mm = 15.0;  // as far from bone a stick goes on

// The picture's axes, unit vectors, bone frame: x right, y up, z to the eye.
struct PictureAxes {
  Vec3 x, y, z;
};

std::optional<PictureAxes> axes_of(const CameraView& view) {
  const Vec3 back = view.eye_mm - view.target_mm;
  const Vec3 right = view.up.cross(back);
  if (!(right.norm() > 0.0)) return std::nullopt;
  return PictureAxes{right.normalized(), back.cross(right).normalized(), back.normalized()};
}

}  // namespace

void ToolPointer::take(const std::string& tool) {
  input_.tool = tool;
  input_.empty_hand = input_.push = false;
  input_.spindle_rpm = 0.0;
  set_wear_and_law(std::nullopt, {});
  turn_.setIdentity();
  roll_rad_ = 0.0;
  aim();
}

void ToolPointer::put_down() {
  input_.empty_hand = true;
  input_.push = false;
  input_.spindle_rpm = 0.0;
  leave();
}

void ToolPointer::set_wear_and_law(const std::optional<double>& wear, const std::string& law) {
  input_.wear = wear;
  input_.law = law;
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
  beside_mm_.setZero();
  hit_ = surface.first_hit(ray.from_mm, ray.direction);
  input_.on_bone = hit_.has_value();
  if (!hit_) return;
  input_.target_mm = hit_->point_mm;
  normal_ = surface.mean_normal(hit_->point_mm, kNormalRadius_mm).value_or(hit_->normal);
  // In a narrow hole the mean may look away from the eye. Then the triangle itself decides.
  if (normal_.dot(ray.direction) > 0.0) normal_ = hit_->normal;
  aim();
}

void ToolPointer::slide(const CameraView& view, double right, double up, double dt_s, const SurfaceScene& surface) {
  const std::optional<PictureAxes> axes = axes_of(view);
  if (!axes) return;
  if (!input_.on_bone) return find_bone(view, surface);
  const Vec3 from = input_.target_mm + (input_.push ? Vec3(Vec3::Zero()) : beside_mm_);
  const double height_mm = 2.0 * (view.eye_mm - from).dot(axes->z) * std::tan(0.5 * view.view_angle_rad);
  double speed_mm_per_s = kSlide_per_s * std::max(0.0, height_mm);
  if (input_.push) speed_mm_per_s = std::min(speed_mm_per_s, kSlidePushing_mm_per_s);
  const Vec3 to = from + speed_mm_per_s * dt_s * (right * axes->x + up * axes->y);
  const SightRay ray{view.eye_mm, (to - view.eye_mm).normalized()};
  if (input_.push) return move(ray, surface);
  const std::optional<SurfaceHit> before = hit_;
  move(ray, surface);
  if (hit_) return;
  hit_ = before;
  input_.on_bone = true;
  beside_mm_ = to - input_.target_mm;
  if (const double far = beside_mm_.norm(); far > kGap_mm) beside_mm_ *= kGap_mm / far;
}

// First where the tool was last, then in a spiral about the picture's middle, evenly over half of its height.
void ToolPointer::find_bone(const CameraView& view, const SurfaceScene& surface) {
  const std::optional<PictureAxes> axes = axes_of(view);
  if (!axes) return;
  if (hit_) move({view.eye_mm, (hit_->point_mm - view.eye_mm).normalized()}, surface);
  constexpr int kLooks = 200;
  constexpr double kGoldenAngle_rad = 2.399963229728653;
  for (int i = 0; i < kLooks && !input_.on_bone; ++i) {
    const double out = std::tan(0.5 * view.view_angle_rad) * std::sqrt(static_cast<double>(i) / kLooks);
    const double angle = kGoldenAngle_rad * i;
    const Vec3 direction = out * (std::cos(angle) * axes->x + std::sin(angle) * axes->y) - axes->z;
    move({view.eye_mm, direction.normalized()}, surface);
  }
}

void ToolPointer::leave() {
  if (!input_.push) input_.on_bone = false;
}

bool ToolPointer::press() {
  if (!input_.on_bone || input_.empty_hand) return false;
  input_.push = true;
  return true;
}

void ToolPointer::release() { input_.push = false; }

void ToolPointer::turn(const CameraView& view, double right_rad, double up_rad) {
  const std::optional<PictureAxes> axes = axes_of(view);
  if (!axes) return;
  turn_ = (Eigen::AngleAxisd(right_rad, axes->y) * Eigen::AngleAxisd(-up_rad, axes->x) * turn_).normalized();
  aim();
}

void ToolPointer::twist(const CameraView& view, const Vec3& twist_rad) {
  const std::optional<PictureAxes> axes = axes_of(view);
  if (!axes || twist_rad.isZero()) return;
  const Vec3 about = twist_rad.x() * axes->x + twist_rad.y() * axes->y + twist_rad.z() * axes->z;
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
