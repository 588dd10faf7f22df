#include "haptic_client/contact/sweep.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::haptic {

void Sweep::reach(const Pose& pose) noexcept {
  to = pose;
  middle = {0.5 * (from.position_mm + to.position_mm), from.rotation.slerp(0.5, to.rotation)};
}

SweepView::SweepView(const Sweep& sweep, const Sweep* before, const Pose& pose_bone_tool, double short_mm) noexcept
    : shape_(sweep.shape) {
  const Pose pose_tool_bone = pose_bone_tool.inverse();
  if (shape_->is_ball()) {
    ball_from_ = pose_tool_bone.point(sweep.from.point(shape_->ball_centre_mm()));
    ball_to_ = pose_tool_bone.point(sweep.to.point(shape_->ball_centre_mm()));
    return;
  }
  const auto add = [&](const Pose& there) {
    const Pose relative = there.inverse() * pose_bone_tool;
    places_[count_++] = {relative.rotation.toRotationMatrix().cast<float>(), relative.position_mm.cast<float>()};
  };
  add(sweep.to);
  if (shape_->open_behind()) {
    // The hole before it began is older, and the tool may have had another position in its play then.
    const double along_mm = (sweep.from.position_mm - sweep.to.position_mm).dot(sweep.to.direction(Vec3::UnitZ()));
    began_mm_ = static_cast<float>(along_mm - shape_->behind_mm());
    return;
  }
  // The sweep before ended where this one began. A short sweep leaves hardly more than its end does.
  const double turned_mm = shape_->behind_mm() * sweep.from.rotation.angularDistance(sweep.to.rotation);
  if ((sweep.from.position_mm - sweep.to.position_mm).norm() + turned_mm < short_mm) return;
  add(sweep.middle);
  const bool seen = before && before->to.position_mm == sweep.from.position_mm &&
                    before->to.rotation.coeffs() == sweep.from.rotation.coeffs();
  if (!seen) add(sweep.from);
}

void SweepView::left_mm(const Lanes (&p)[3], Lanes& left, Parts& by) const noexcept {
  by.fill(0);
  if (shape_->is_ball()) {
    const Vec3 way = ball_to_ - ball_from_;
    const double length2 = way.squaredNorm();
    const float radius = static_cast<float>(shape_->radius_mm());
    const float inverse = length2 > 1e-12 ? static_cast<float>(1.0 / length2) : 0.0f;
    const Eigen::Vector3f a = ball_from_.cast<float>(), ab = way.cast<float>();
    for (std::size_t i = 0; i < kGroupPoints; ++i) {
      const float x = a[0] - p[0][i], y = a[1] - p[1][i], z = a[2] - p[2][i];
      const float t = std::min(1.0f, std::max(0.0f, -((x * ab[0] + y * ab[1]) + z * ab[2]) * inverse));
      const float dx = x + t * ab[0], dy = y + t * ab[1], dz = z + t * ab[2];
      left[i] = radius - std::sqrt(dx * dx + dy * dy + dz * dz);
    }
    return;
  }
  Lanes distance = shape_->distance_mm(places_[0], p);
  for (int other = 1; other < count_; ++other) {
    const Lanes there = shape_->distance_mm(places_[other], p);
    for (std::size_t i = 0; i < kGroupPoints; ++i) {
      const bool nearer = there[i] < distance[i];
      distance[i] = nearer ? there[i] : distance[i];
      by[i] = nearer ? other : by[i];
    }
  }
  for (std::size_t i = 0; i < kGroupPoints; ++i) left[i] = -distance[i];
  if (!shape_->open_behind()) return;
  const Eigen::Vector3f axis = places_[0].rotation.row(2);
  const float from = places_[0].at[2] - began_mm_;
  for (std::size_t i = 0; i < kGroupPoints; ++i) {
    const float along = ((p[0][i] * axis[0] + p[1][i] * axis[1]) + p[2][i] * axis[2]) + from;
    const bool behind = along < left[i];
    left[i] = behind ? along : left[i];
    by[i] = behind ? kBehind : by[i];
  }
}

Vec3 SweepView::way_out(const Vec3& p, int by) const noexcept {
  if (shape_->is_ball()) {
    const Vec3 way = ball_to_ - ball_from_;
    const double length2 = way.squaredNorm();
    const double along = length2 > 0.0 ? std::clamp((p - ball_from_).dot(way) / length2, 0.0, 1.0) : 0.0;
    const Vec3 inwards = ball_from_ + along * way - p;
    const double distance = inwards.norm();
    return distance > 0.0 ? Vec3(inwards / distance) : Vec3(Vec3::UnitZ());
  }
  if (by == kBehind) return places_[0].rotation.row(2).cast<double>();
  const HullPlace& place = places_[by];
  const Eigen::Matrix3d rotation = place.rotation.cast<double>();
  Vec3 out;
  static_cast<void>(shape_->distance_mm(rotation * p + place.at.cast<double>(), out));
  return -(rotation.transpose() * out);
}

}  // namespace osteon::haptic
