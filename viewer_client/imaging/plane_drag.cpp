#include "viewer_client/imaging/plane_drag.hpp"

#include <algorithm>
#include <cmath>

#include "viewer_client/imaging/corrected_plane.hpp"

namespace osteon {

namespace {

Vec3 steps_between(const std::array<int, 3>& from, const std::array<int, 3>& to) {
  return {static_cast<double>(to[0] - from[0]), static_cast<double>(to[1] - from[1]),
          static_cast<double>(to[2] - from[2])};
}

Vec3 whole_micrometres(const Vec3& at_mm) {
  return {std::round(1000.0 * at_mm.x()) / 1000.0, std::round(1000.0 * at_mm.y()) / 1000.0,
          std::round(1000.0 * at_mm.z()) / 1000.0};
}

}  // namespace

void PlaneDrag::move(const std::array<int, 3>& voxel) {
  if (voxel == last()) return;
  if (voxels_.size() > 1) {
    const Vec3 before = steps_between(voxels_[voxels_.size() - 2], last()), next = steps_between(last(), voxel);
    // Straight on: whole numbers are exact.
    if (before.cross(next) == Vec3::Zero() && before.dot(next) > 0.0) voxels_.pop_back();
  }
  voxels_.push_back(voxel);
}

Correction PlaneDrag::stroke(const ScanGeometry& scan, int bone, double radius_mm, bool flat) const {
  const bool paints = tool_ == ImagingTool::paint;
  Correction stroke{paints ? CorrectionKind::paint : CorrectionKind::erase, paints ? bone : 0, {}, radius_mm};
  for (const std::array<int, 3>& voxel : voxels_) stroke.points_mm.push_back(whole_micrometres(centre_of(scan, voxel)));
  if (flat) stroke.normal = scan.axes_mm.col(axes_.through).normalized();
  return stroke;
}

std::optional<Correction> PlaneDrag::cut(const ScanGeometry& scan, int bone) const {
  const auto [column_a, row_a, slice_a] = place_in(axes_, first());
  const auto [column_b, row_b, slice_b] = place_in(axes_, last());
  if (column_a == column_b && row_a == row_b) return {};
  const double right_mm = (column_b - column_a) * axes_.right_mm, down_mm = (row_b - row_a) * axes_.down_mm;
  const Vec3 right = scan.axes_mm.col(axes_.right).normalized() * (axes_.flip_right ? -1.0 : 1.0);
  const Vec3 down = scan.axes_mm.col(axes_.down).normalized() * (axes_.flip_down ? -1.0 : 1.0);
  // On the screen, where y goes down, the right hand of (x, y) is (-y, x).
  return Correction{CorrectionKind::cut,
                    bone,
                    {whole_micrometres(centre_of(scan, first()))},
                    0.0,
                    (right_mm * down - down_mm * right).normalized()};
}

std::optional<MarkedBox> PlaneDrag::box(const ScanGeometry& scan, const std::optional<MarkedBox>& before) const {
  if (first() == last()) return {};
  const VoxelRange whole = range_of(scan, {});
  VoxelRange range = range_of(scan, before);
  for (const int axis : {axes_.right, axes_.down}) {
    const auto a = static_cast<std::size_t>(axis);
    range.first[a] = std::min(first()[a], last()[a]);
    range.last[a] = std::max(first()[a], last()[a]);
  }
  if (range == whole) return {};
  return MarkedBox{centre_of(scan, range.first), centre_of(scan, range.last)};
}

}  // namespace osteon
