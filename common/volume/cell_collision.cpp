#include "common/volume/cell_collision.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"

namespace osteon {
namespace {

std::size_t count(Coord dims) { return to_index(dims.x) * to_index(dims.y) * to_index(dims.z); }

// The position of a point in a lattice: its cell, counted from the first, and the position in it. False outside.
struct Place {
  Coord cell;
  double x, y, z;
};
bool locate(const Vec3& point_mm, double pitch_mm, const CoordBox& samples, Coord cells, Place& place) {
  const Vec3 p = point_mm / pitch_mm - Vec3{static_cast<double>(samples.min.x), static_cast<double>(samples.min.y),
                                            static_cast<double>(samples.min.z)};
  // Also false for NaN.
  if (!(p.x() >= 0.0 && p.y() >= 0.0 && p.z() >= 0.0 && p.x() < cells.x && p.y() < cells.y && p.z() < cells.z))
    return false;
  place.cell = {static_cast<std::int32_t>(p.x()), static_cast<std::int32_t>(p.y()), static_cast<std::int32_t>(p.z())};
  place.x = p.x() - place.cell.x;
  place.y = p.y() - place.cell.y;
  place.z = p.z() - place.cell.z;
  return true;
}

template <class Inside>
std::optional<std::size_t> first_inside(std::span<const SamplePoint> points, const Pose& pose, Inside inside) {
  for (std::size_t i = 0; i < points.size(); ++i)
    if (inside(Vec3(pose.rotation * points[i].position_mm + pose.position_mm))) return i;
  return std::nullopt;
}

}  // namespace

BoneCells::BoneCells(const CutField& field, int level, const CoordBox& samples)
    : level_(level),
      pitch_mm_(level_pitch_mm(field.bone().pitch_mm(), level)),
      samples_(samples),
      cells_(samples.dims() - Coord{1, 1, 1}) {
  OSTEON_CHECK(cells_.x > 0 && cells_.y > 0 && cells_.z > 0);
  codes_.resize(count(cells_));
  update(field, samples);
}

void BoneCells::update(const CutField& field, const CoordBox& changed) {
  // A sample is also a corner of the cells before it.
  const CoordBox box{{std::max(samples_.min.x, changed.min.x - 1), std::max(samples_.min.y, changed.min.y - 1),
                      std::max(samples_.min.z, changed.min.z - 1)},
                     {std::min(samples_.max.x, changed.max.x + 1), std::min(samples_.max.y, changed.max.y + 1),
                      std::min(samples_.max.z, changed.max.z + 1)}};
  if (box.empty()) return;
  const Coord dims = box.dims();
  std::vector<float> f(count(dims));
  field.gather_solid(level_, box, f);
  const std::size_t sx = to_index(dims.y) * to_index(dims.z), sy = to_index(dims.z);
  for (std::int32_t x = 0; x + 1 < dims.x; ++x)
    for (std::int32_t y = 0; y + 1 < dims.y; ++y)
      for (std::int32_t z = 0; z + 1 < dims.z; ++z) {
        const float* p = f.data() + to_index(x) * sx + to_index(y) * sy + to_index(z);
        const float corners[8] = {p[0], p[1], p[sy], p[sy + 1], p[sx], p[sx + 1], p[sx + sy], p[sx + sy + 1]};
        unsigned code = 0;
        for (unsigned i = 0; i < 8; ++i) code |= corners[i] < 0.0f ? 1u << i : 0u;
        const Coord cell = box.min + Coord{x, y, z} - samples_.min;
        codes_[(to_index(cell.x) * to_index(cells_.y) + to_index(cell.y)) * to_index(cells_.z) + to_index(cell.z)] =
            static_cast<std::uint8_t>(code);
      }
}

bool BoneCells::inside(const Vec3& point_mm, MixedCell rule) const {
  Place p;
  if (!locate(point_mm, pitch_mm_, samples_, cells_, p)) return false;
  const unsigned code =
      codes_[(to_index(p.cell.x) * to_index(cells_.y) + to_index(p.cell.y)) * to_index(cells_.z) + to_index(p.cell.z)];
  if (code == 0) return false;
  if (code == 255) return true;
  if (rule == MixedCell::nearest)
    return code >> ((p.x >= 0.5 ? 4 : 0) + (p.y >= 0.5 ? 2 : 0) + (p.z >= 0.5 ? 1 : 0)) & 1u;
  double bone = 0.0;
  for (unsigned i = 0; i < 8; ++i)
    if (code >> i & 1u) bone += (i & 4 ? p.x : 1.0 - p.x) * (i & 2 ? p.y : 1.0 - p.y) * (i & 1 ? p.z : 1.0 - p.z);
  return bone >= 0.5;
}

BoneDistance::BoneDistance(const CutField& field, int level, const CoordBox& samples)
    : pitch_mm_(level_pitch_mm(field.bone().pitch_mm(), level)), samples_(samples), dims_(samples.dims()) {
  OSTEON_CHECK(dims_.x > 1 && dims_.y > 1 && dims_.z > 1);
  values_.resize(count(dims_));
  field.gather_solid(level, samples, values_);
}

double BoneDistance::distance_mm(const Vec3& point_mm) const {
  Place p;
  if (!locate(point_mm, pitch_mm_, samples_, dims_ - Coord{1, 1, 1}, p)) return 1e9;
  const std::size_t sx = to_index(dims_.y) * to_index(dims_.z), sy = to_index(dims_.z);
  const float* v = values_.data() + to_index(p.cell.x) * sx + to_index(p.cell.y) * sy + to_index(p.cell.z);
  const auto along_z = [&](std::size_t i) {
    const auto low = static_cast<double>(v[i]), high = static_cast<double>(v[i + 1]);
    return low + p.z * (high - low);
  };
  const double near_x = along_z(0) + p.y * (along_z(sy) - along_z(0));
  const double far_x = along_z(sx) + p.y * (along_z(sx + sy) - along_z(sx));
  return near_x + p.x * (far_x - near_x);
}

std::optional<std::size_t> first_contact(const BoneCells& bone, MixedCell rule, std::span<const SamplePoint> points,
                                         const Pose& pose_bone_tool) {
  return first_inside(points, pose_bone_tool, [&](const Vec3& p) { return bone.inside(p, rule); });
}

std::optional<std::size_t> first_contact(const BoneDistance& bone, std::span<const SamplePoint> points,
                                         const Pose& pose_bone_tool) {
  return first_inside(points, pose_bone_tool, [&](const Vec3& p) { return bone.inside(p); });
}

}  // namespace osteon
