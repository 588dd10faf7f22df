#include "haptic_client/contact/obstacle.hpp"

#include <algorithm>
#include <cmath>

#include "common/tools/tool_solid.hpp"

namespace osteon::haptic {

SolidLattice::SolidLattice(const Tool& item) {
  constexpr double kFinest_mm = 0.2, kMostSamples = 4e5;
  const Implicit solid = tool_solid(item);
  box_ = solid.bounds.grown(margin_mm);
  const Vec3 size = box_.size_mm();
  pitch_mm_ = std::max(kFinest_mm, std::cbrt(size.prod() / kMostSamples));
  const auto samples = [&](int axis) { return static_cast<std::int32_t>(std::ceil(size[axis] / pitch_mm_)) + 1; };
  dims_ = {samples(0), samples(1), samples(2)};
  box_.max_mm = box_.min_mm + pitch_mm_ * Vec3(dims_.x - 1, dims_.y - 1, dims_.z - 1);
  values_.reserve(static_cast<std::size_t>(dims_.x) * static_cast<std::size_t>(dims_.y) *
                  static_cast<std::size_t>(dims_.z));
  for (Coord c; c.x < dims_.x; ++c.x)
    for (c.y = 0; c.y < dims_.y; ++c.y)
      for (c.z = 0; c.z < dims_.z; ++c.z)
        values_.push_back(static_cast<float>(solid(box_.min_mm + position_mm(c, pitch_mm_))));
}

bool SolidLattice::near(const Vec3& point_mm, double radius_mm) const noexcept {
  return (point_mm.array() >= box_.min_mm.array() - radius_mm).all() &&
         (point_mm.array() <= box_.max_mm.array() + radius_mm).all();
}

bool SolidLattice::sample(const Vec3& point_mm, double& distance_mm, Vec3& gradient) const noexcept {
  const Vec3 at = (point_mm - box_.min_mm) / pitch_mm_;
  const Coord c{static_cast<std::int32_t>(std::floor(at.x())), static_cast<std::int32_t>(std::floor(at.y())),
                static_cast<std::int32_t>(std::floor(at.z()))};
  if (c.x < 0 || c.y < 0 || c.z < 0 || c.x + 1 >= dims_.x || c.y + 1 >= dims_.y || c.z + 1 >= dims_.z) return false;
  const Vec3 t = at - Vec3(c.x, c.y, c.z);
  const std::ptrdiff_t step_y = dims_.z, step_x = static_cast<std::ptrdiff_t>(dims_.y) * dims_.z;
  const float* v = &values_[static_cast<std::size_t>(c.x * step_x + c.y * step_y + c.z)];
  const auto at_corner = [&](std::ptrdiff_t i) { return static_cast<double>(v[i]); };
  const double d00 = at_corner(1) - at_corner(0), d01 = at_corner(step_y + 1) - at_corner(step_y);
  const double d10 = at_corner(step_x + 1) - at_corner(step_x),
               d11 = at_corner(step_x + step_y + 1) - at_corner(step_x + step_y);
  const double c00 = at_corner(0) + t.z() * d00, c01 = at_corner(step_y) + t.z() * d01;
  const double c10 = at_corner(step_x) + t.z() * d10, c11 = at_corner(step_x + step_y) + t.z() * d11;
  const double e0 = c01 - c00, e1 = c11 - c10, b0 = c00 + t.y() * e0, b1 = c10 + t.y() * e1;
  const double f0 = d00 + t.y() * (d01 - d00), f1 = d10 + t.y() * (d11 - d10);
  distance_mm = b0 + t.x() * (b1 - b0);
  gradient = Vec3(b1 - b0, e0 + t.x() * (e1 - e0), f0 + t.x() * (f1 - f0)) / pitch_mm_;
  return true;
}

}  // namespace osteon::haptic
