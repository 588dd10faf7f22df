#include "haptic_client/contact/patch.hpp"

#include <cmath>

#include "common/core/check.hpp"

namespace osteon::haptic {

void BrickGrid::reset(double pitch_mm, Coord first, Coord last) {
  pitch_mm_ = pitch_mm;
  first_ = first;
  dims_ = CoordBox{first, last}.dims();
  bricks_.clear();
  tables_.assign(to_index(dims_.x) * to_index(dims_.y) * to_index(dims_.z), nullptr);
}

void BrickGrid::set(Coord brick, std::shared_ptr<const Brick> values) {
  const Coord at = brick - first_;
  OSTEON_CHECK(at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x < dims_.x && at.y < dims_.y && at.z < dims_.z);
  const auto place = static_cast<std::size_t>((at.x * dims_.y + at.y) * dims_.z + at.z);
  tables_[place] = values ? values->values.data() : nullptr;
  bricks_.push_back(std::move(values));
}

bool BrickGrid::sample(const Vec3& point_mm, double& value) const noexcept {
  if (tables_.empty()) return false;
  const Vec3 in_samples = point_mm / pitch_mm_;
  const Vec3 cell = in_samples.array().floor();
  const Coord c{static_cast<std::int32_t>(cell.x()), static_cast<std::int32_t>(cell.y()),
                static_cast<std::int32_t>(cell.z())};
  const Coord at = shift_down(c, 3) - first_;
  if (at.x < 0 || at.y < 0 || at.z < 0 || at.x >= dims_.x || at.y >= dims_.y || at.z >= dims_.z) return false;
  const float* const brick = tables_[static_cast<std::size_t>((at.x * dims_.y + at.y) * dims_.z + at.z)];
  if (!brick) return false;

  const Vec3 t = in_samples - cell;
  const float* v =
      brick + static_cast<std::size_t>(((c.x & 7) * kBrickSamples + (c.y & 7)) * kBrickSamples + (c.z & 7));
  constexpr int kY = kBrickSamples, kX = kBrickSamples * kBrickSamples;
  const auto along_z = [&](int offset) { return v[offset] + t.z() * (v[offset + 1] - v[offset]); };
  const double v00 = along_z(0), v01 = along_z(kY), v10 = along_z(kX), v11 = along_z(kX + kY);
  const double v0 = v00 + t.y() * (v01 - v00), v1 = v10 + t.y() * (v11 - v10);
  value = v0 + t.x() * (v1 - v0);
  return true;
}

}  // namespace osteon::haptic
