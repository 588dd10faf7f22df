#include "haptic_client/contact/cut_shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace osteon::haptic {
namespace {

double sampled_mm(const SampledDistance& mesh, const Vec3& p) noexcept {
  const double pitch = mesh.pitch * kQuantum_mm;
  const Coord dims = mesh.box.dims();
  const std::int32_t size[3] = {dims.x, dims.y, dims.z}, first[3] = {mesh.box.min.x, mesh.box.min.y, mesh.box.min.z};
  std::int32_t base[3];
  double t[3], outside = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double wanted = p[k] / pitch - first[k], within = std::clamp(wanted, 0.0, static_cast<double>(size[k] - 1));
    base[k] = std::min(static_cast<std::int32_t>(within), size[k] - 2);
    t[k] = within - base[k];
    outside += (wanted - within) * (wanted - within);
  }
  double value = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner >> 2, j = (corner >> 1) & 1, k = corner & 1;
    const auto index = (static_cast<std::size_t>(base[0] + i) * static_cast<std::size_t>(size[1]) +
                        static_cast<std::size_t>(base[1] + j)) *
                           static_cast<std::size_t>(size[2]) +
                       static_cast<std::size_t>(base[2] + k);
    value +=
        mesh.values[index] * kQuantum_mm * (i ? t[0] : 1.0 - t[0]) * (j ? t[1] : 1.0 - t[1]) * (k ? t[2] : 1.0 - t[2]);
  }
  return value + pitch * std::sqrt(outside);
}

}  // namespace

CutShape::CutShape(const Tool& tool, bool open_behind) : open_behind_(open_behind) {
  const CutBody body = tool.cut_body();
  kind_ = body.kind;
  behind_mm_ = tool.cutting_length_mm;
  const auto add = [&](const Vec3& n, double offset_mm) {
    planes_[static_cast<std::size_t>(count_++)] = {n, offset_mm};
  };
  constexpr double kSideways = 1e-9;
  if (kind_ == CutKind::ball) radius_mm_ = kQuantum_mm * body.radius;
  if (kind_ == CutKind::sampled) sampled_ = body.sampled;
  if (kind_ == CutKind::turned) {
    radius_mm_ = kQuantum_mm * body.dome;
    double widest = 0.0, narrowest = std::numeric_limits<double>::max();
    const std::size_t corners = std::min(body.profile.size(), kMostProfileCorners);
    behind_mm_ = 0.0;
    for (std::size_t i = 0; i < corners; ++i) {
      const ProfileCorner a = body.profile[i], b = body.profile[(i + 1) % corners];
      widest = std::max(widest, kQuantum_mm * a.r);
      behind_mm_ = std::max(behind_mm_, -kQuantum_mm * a.z);
      narrowest = std::min(narrowest, kQuantum_mm * a.r);
      const double er = kQuantum_mm * (b.r - a.r), ez = kQuantum_mm * (b.z - a.z), length = std::hypot(er, ez);
      if (!(length > 0.0) || (a.r == 0 && b.r == 0)) continue;  // the axis is no face
      if (open_behind && !(-er > kSideways)) continue;          // points back or sideways
      add({ez / length, 0.0, -er / length}, (ez * kQuantum_mm * a.r - er * kQuantum_mm * a.z) / length);
    }
    if (open_behind) {
      add({1, 0, 0}, widest);
      if (narrowest > 0.0) add({-1, 0, 0}, -narrowest);  // hollow: the core in the middle stays
      add({0, 0, -1}, tool.cutting_length_mm);
    }
  }
  for (const HullPlane& plane : body.planes) {
    const Vec3 n = Vec3(plane.normal[0], plane.normal[1], plane.normal[2]).normalized();
    if (!(open_behind && n.z() < -kSideways)) add(n, kQuantum_mm * plane.offset);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i) {
    const Plane& plane = planes_[i];
    faces_[i] = {static_cast<float>(plane.n.x()), static_cast<float>(plane.n.y()), static_cast<float>(plane.n.z()),
                 static_cast<float>(plane.offset_mm)};
  }
}

double CutShape::distance_mm(const Vec3& p, Vec3& out) const noexcept {
  out = Vec3::UnitZ();
  if (kind_ == CutKind::none) return std::numeric_limits<double>::max();
  if (kind_ == CutKind::ball) {
    const Vec3 from = p - ball_centre_mm();
    const double length = from.norm();
    if (length > 0.0) out = from / length;
    return length - radius_mm_;
  }
  if (kind_ == CutKind::sampled) {
    const double step = sampled_->pitch * kQuantum_mm;
    for (int k = 0; k < 3; ++k)
      out[k] = sampled_mm(*sampled_, p + step * Vec3::Unit(k)) - sampled_mm(*sampled_, p - step * Vec3::Unit(k));
    out.normalize();
    return sampled_mm(*sampled_, p);
  }
  const bool turned = kind_ == CutKind::turned;
  const double r = std::sqrt(p.x() * p.x() + p.y() * p.y());
  const Vec3 at = turned ? Vec3(r, 0.0, p.z()) : p;
  double distance = -std::numeric_limits<double>::max();
  int nearest = 0;
  for (int i = 0; i < count_; ++i) {
    const Plane& plane = planes_[static_cast<std::size_t>(i)];
    const double to_plane = plane.n.dot(at) - plane.offset_mm;
    if (to_plane > distance) distance = to_plane, nearest = i;
  }
  Vec3 normal = planes_[static_cast<std::size_t>(nearest)].n;
  if (turned && radius_mm_ > 0.0 && p.z() > -radius_mm_) {
    const double to_dome = std::hypot(r, p.z() + radius_mm_) - radius_mm_;
    if (to_dome > distance) distance = to_dome, normal = Vec3(r, 0.0, p.z() + radius_mm_) / (to_dome + radius_mm_);
  }
  out = normal;
  if (turned)
    out =
        r > 0.0 ? Vec3(normal.x() * p.x() / r, normal.x() * p.y() / r, normal.z()) : Vec3(normal.x(), 0.0, normal.z());
  return distance;
}

Lanes CutShape::distance_mm(const HullPlace& place, const Lanes (&p)[3]) const noexcept {
  const std::span faces(faces_.data(), static_cast<std::size_t>(count_));
  if (kind_ == CutKind::hull) return hull_distance_mm(place, faces, p);
  Lanes q[3], distance;
  for (int k = 0; k < 3; ++k) {
    const float x = place.rotation(k, 0), y = place.rotation(k, 1), z = place.rotation(k, 2), from = place.at[k];
    for (std::size_t i = 0; i < kGroupPoints; ++i) q[k][i] = ((p[0][i] * x + p[1][i] * y) + p[2][i] * z) + from;
  }
  if (kind_ != CutKind::turned) {
    for (std::size_t i = 0; i < kGroupPoints; ++i)
      distance[i] = static_cast<float>(std::min(distance_mm(Vec3(q[0][i], q[1][i], q[2][i])), double{kLeftOut_mm}));
    return distance;
  }
  // In the half plane through the axis.
  for (std::size_t i = 0; i < kGroupPoints; ++i) {
    q[0][i] = std::sqrt(q[0][i] * q[0][i] + q[1][i] * q[1][i]);
    q[1][i] = 0.0f;
  }
  distance = hull_distance_mm({}, faces, q);
  const float dome = static_cast<float>(radius_mm_);
  if (dome > 0.0f)
    for (std::size_t i = 0; i < kGroupPoints; ++i) {
      const float up = q[2][i] + dome, to_dome = std::sqrt(q[0][i] * q[0][i] + up * up) - dome;
      distance[i] = up > 0.0f && to_dome > distance[i] ? to_dome : distance[i];
    }
  return distance;
}

}  // namespace osteon::haptic
