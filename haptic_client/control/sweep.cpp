#include "haptic_client/control/sweep.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::haptic {

void Sweep::reach(const Pose& pose) noexcept {
  to = pose;
  middle = {0.5 * (from.position_mm + to.position_mm), from.rotation.slerp(0.5, to.rotation)};
}

SweepView::SweepView(const Sweep& sweep, const Pose& pose_bone_tool, double short_mm) noexcept : shape_(sweep.shape) {
  const Pose pose_tool_bone = pose_bone_tool.inverse();
  if (shape_->is_ball()) {
    ball_from_ = pose_tool_bone.point(sweep.from.point(shape_->ball_centre_mm()));
    ball_to_ = pose_tool_bone.point(sweep.to.point(shape_->ball_centre_mm()));
    return;
  }
  const auto add = [&](const Pose& there) {
    const Pose relative = there.inverse() * pose_bone_tool;
    const Eigen::Matrix3d rotation = relative.rotation.toRotationMatrix();
    Place& place = places_[count_++];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) place.rotation[3 * i + j] = static_cast<float>(rotation(i, j));
      place.at[i] = static_cast<float>(relative.position_mm[i]);
    }
  };
  add(sweep.to);
  if (shape_->open_behind()) {
    // The hole before it began is older: that tool may have stood elsewhere in its play.
    const double along_mm = (sweep.from.position_mm - sweep.to.position_mm).dot(sweep.to.direction(Vec3::UnitZ()));
    began_mm_ = static_cast<float>(along_mm - shape_->behind_mm());
    return;
  }
  // Where it began the sweep before ended; a short one leaves hardly more than its end does.
  const double turned_mm = shape_->behind_mm() * sweep.from.rotation.angularDistance(sweep.to.rotation);
  if ((sweep.from.position_mm - sweep.to.position_mm).norm() + turned_mm < short_mm) return;
  add(sweep.middle);
  add(sweep.from);
}

void SweepView::Place::distance_mm(const CutShape& shape, const Lanes (&p)[3], Lanes& distance, Lanes (&out)[3]) const noexcept {
  const float(&r)[9] = rotation;
  Lanes q[3], way[3];
  for (int k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < kGroupPoints; ++i)
      q[k][i] = ((p[0][i] * r[3 * k] + p[1][i] * r[3 * k + 1]) + p[2][i] * r[3 * k + 2]) + at[k];
  shape.distance_mm(q, distance, way);
  for (int k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < kGroupPoints; ++i)
      out[k][i] = -((way[0][i] * r[k] + way[1][i] * r[3 + k]) + way[2][i] * r[6 + k]);
}

void SweepView::left_mm(const Lanes (&p)[3], Lanes& left, Lanes (&out)[3]) const noexcept {
  if (shape_->is_ball()) {
    const Vec3 way = ball_to_ - ball_from_;
    const double length2 = way.squaredNorm();
    const float radius = static_cast<float>(shape_->radius_mm());
    const float inverse = length2 > 1e-12 ? static_cast<float>(1.0 / length2) : 0.0f;
    float a[3], ab[3];
    for (int k = 0; k < 3; ++k) {
      a[k] = static_cast<float>(ball_from_[k]);
      ab[k] = static_cast<float>(way[k]);
    }
    for (std::size_t i = 0; i < kGroupPoints; ++i) {
      const float x = a[0] - p[0][i], y = a[1] - p[1][i], z = a[2] - p[2][i];
      const float t = std::min(1.0f, std::max(0.0f, -((x * ab[0] + y * ab[1]) + z * ab[2]) * inverse));
      const float dx = x + t * ab[0], dy = y + t * ab[1], dz = z + t * ab[2], distance = std::sqrt(dx * dx + dy * dy + dz * dz);
      const float scale = distance > 0.0f ? 1.0f / distance : 0.0f;
      left[i] = radius - distance;
      out[0][i] = dx * scale;
      out[1][i] = dy * scale;
      out[2][i] = dz * scale;
    }
    return;
  }
  Lanes distance;
  places_[0].distance_mm(*shape_, p, distance, out);
  if (shape_->open_behind()) {
    const float(&r)[9] = places_[0].rotation;
    for (std::size_t i = 0; i < kGroupPoints; ++i) {
      const float along = ((p[0][i] * r[6] + p[1][i] * r[7]) + p[2][i] * r[8]) + places_[0].at[2] - began_mm_;
      const bool behind = along < -distance[i];
      left[i] = behind ? along : -distance[i];
      for (int k = 0; k < 3; ++k) out[k][i] = behind ? r[6 + k] : out[k][i];
    }
    return;
  }
  for (int other = 1; other < count_; ++other) {
    Lanes there, way[3];
    places_[other].distance_mm(*shape_, p, there, way);
    for (std::size_t i = 0; i < kGroupPoints; ++i) {
      const bool nearer = there[i] < distance[i];
      distance[i] = nearer ? there[i] : distance[i];
      for (int k = 0; k < 3; ++k) out[k][i] = nearer ? way[k][i] : out[k][i];
    }
  }
  for (std::size_t i = 0; i < kGroupPoints; ++i) left[i] = -distance[i];
}

}  // namespace osteon::haptic
