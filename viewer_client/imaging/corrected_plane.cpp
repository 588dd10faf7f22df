#include "viewer_client/imaging/corrected_plane.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/geometry/segment.hpp"

namespace osteon {

namespace {

constexpr double kSameLength_mm = 1e-9;  // as in osteon-import

Vec3 voxels_of(const ScanGeometry& scan, const Vec3& at_mm) {
  return scan.axes_mm.inverse() * (at_mm - scan.origin_mm);
}

// The voxels of a range that a stroke may reach between two of its points.
VoxelRange around(const ScanGeometry& scan, const VoxelRange& within, const Vec3& a_mm, const Vec3& b_mm,
                  double radius_mm) {
  const Vec3 a = voxels_of(scan, a_mm), b = voxels_of(scan, b_mm);
  VoxelRange range;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis);
    const double reach = radius_mm / scan.axes_mm.col(i).norm() + kSameLength_mm;
    const double first = within.first[axis], last = within.last[axis];
    range.first[axis] = static_cast<int>(std::clamp(std::ceil(std::min(a[i], b[i]) - reach), first, last + 1.0));
    range.last[axis] = static_cast<int>(std::clamp(std::floor(std::max(a[i], b[i]) + reach), first - 1.0, last));
  }
  return range;
}

// Calls `visit` with each voxel of the range that the stroke changes, until it returns false. Voxels may come again.
template <class Visit>
void each_voxel(const ScanGeometry& scan, const VoxelRange& within, const Correction& stroke, Visit visit) {
  const bool flat = stroke.normal != Vec3::Zero();
  const double half_mm = flat ? 0.5 * (scan.axes_mm.transpose() * stroke.normal).cwiseAbs().sum() : 0.0;
  const std::vector<Vec3>& points = stroke.points_mm;
  for (std::size_t i = points.size() == 1 ? 0 : 1; i < points.size(); ++i) {
    const Vec3 &from = points[i == 0 ? 0 : i - 1], &to = points[i];
    const VoxelRange range = around(scan, within, from, to, stroke.radius_mm);
    for (int z = range.first[2]; z <= range.last[2]; ++z)
      for (int y = range.first[1]; y <= range.last[1]; ++y)
        for (int x = range.first[0]; x <= range.last[0]; ++x) {
          const Vec3 at = scan.position_mm(Vec3(x, y, z));
          if (flat && std::abs(stroke.normal.dot(at - points.front())) >= half_mm - kSameLength_mm) continue;
          if (segment_distance_mm(at, from, to) > stroke.radius_mm + kSameLength_mm) continue;
          if (!visit(std::array<int, 3>{x, y, z})) return;
        }
  }
}

// The voxels of a plane.
VoxelRange plane_range(const ScanGeometry& scan, const PlaneAxes& axes, int slice) {
  VoxelRange range = range_of(scan, {});
  const auto through = static_cast<std::size_t>(axes.through);
  range.first[through] = range.last[through] = voxel_at(axes, 0, 0, slice)[through];
  return range;
}

class Marks {
 public:
  Marks(const IslandMap& islands, const BonesOfIslands& bones, const PlaneAxes& axes)
      : islands_(islands),
        bones_(bones),
        axes_(axes),
        of_pixel_(static_cast<std::size_t>(axes.columns) * static_cast<std::size_t>(axes.rows)) {}

  void play(const ScanGeometry& scan, const VoxelRange& plane, const Correction& correction) {
    const auto change = [&](const std::array<int, 3>& voxel) {
      std::uint8_t& mark = at(voxel);
      if (correction.kind == CorrectionKind::paint)
        mark = static_cast<std::uint8_t>(correction.bone);
      else if (is_bone(mark, voxel, correction))
        mark = kErased;
      return true;
    };
    if (correction.kind != CorrectionKind::cut) return each_voxel(scan, plane, correction, change);
    for (int z = plane.first[2]; z <= plane.last[2]; ++z)
      for (int y = plane.first[1]; y <= plane.last[1]; ++y)
        for (int x = plane.first[0]; x <= plane.last[0]; ++x)
          if (correction.normal.dot(scan.position_mm(Vec3(x, y, z)) - correction.points_mm.front()) >= -kSameLength_mm)
            change({x, y, z});
  }
  // The mark of a voxel of the plane.
  [[nodiscard]] std::uint8_t& at(const std::array<int, 3>& voxel) {
    const auto [column, row, slice] = place_in(axes_, voxel);
    return of_pixel_[static_cast<std::size_t>(row) * static_cast<std::size_t>(axes_.columns) +
                     static_cast<std::size_t>(column)];
  }
  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(of_pixel_); }

 private:
  // Whether the voxel is of a bone that the correction takes away.
  [[nodiscard]] bool is_bone(std::uint8_t mark, const std::array<int, 3>& voxel, const Correction& correction) const {
    const bool any = correction.kind == CorrectionKind::erase;
    if (mark == kErased) return false;
    if (mark != 0) return any || mark == correction.bone;
    const std::bitset<256>& bones = bones_[islands_.number(voxel)];
    return any ? bones.any() : bones.test(static_cast<std::size_t>(correction.bone));
  }

  const IslandMap& islands_;
  const BonesOfIslands& bones_;
  const PlaneAxes& axes_;
  std::vector<std::uint8_t> of_pixel_;
};

}  // namespace

VoxelRange range_of(const ScanGeometry& scan, const std::optional<MarkedBox>& box) {
  VoxelRange range{{0, 0, 0}, {scan.dims[0] - 1, scan.dims[1] - 1, scan.dims[2] - 1}};
  if (!box) return range;
  const Vec3 a = voxels_of(scan, box->corner_mm), b = voxels_of(scan, box->opposite_mm);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis);
    range.first[axis] = std::max(range.first[axis], static_cast<int>(std::lround(std::min(a[i], b[i]))));
    range.last[axis] = std::min(range.last[axis], static_cast<int>(std::lround(std::max(a[i], b[i]))));
  }
  return range;
}

int shown_bone(const std::bitset<256>& bones) {
  for (std::size_t bone = 1; bone < bones.size(); ++bone)
    if (bones.test(bone)) return static_cast<int>(bone);
  return 0;
}

bool reaches(const ScanGeometry& scan, const VoxelRange& range, const Correction& stroke) {
  bool found = false;
  each_voxel(scan, range, stroke, [&](const std::array<int, 3>&) {
    found = true;
    return false;
  });
  return found;
}

std::vector<std::uint8_t> corrected_plane(const ScanGeometry& scan, const IslandMap& islands,
                                          const BonesOfIslands& bones, const PlaneAxes& axes, int slice,
                                          std::span<const SharedCorrection> corrections) {
  if (corrections.empty()) return {};
  Marks marks(islands, bones, axes);
  const VoxelRange plane = plane_range(scan, axes, slice);
  for (const SharedCorrection& correction : corrections) marks.play(scan, plane, *correction);
  return marks.take();
}

std::bitset<256> bones_at(const ScanGeometry& scan, const IslandMap& islands, const BonesOfIslands& bones,
                          const std::array<int, 3>& voxel, std::span<const SharedCorrection> corrections) {
  const PlaneAxes axes = axes_of(scan, Plane::axial);
  Marks marks(islands, bones, axes);
  for (const SharedCorrection& correction : corrections) marks.play(scan, {voxel, voxel}, *correction);
  const std::uint8_t mark = marks.at(voxel);
  if (mark == 0) return bones[islands.number(voxel)];
  return mark == kErased ? std::bitset<256>() : std::bitset<256>().set(mark);
}

}  // namespace osteon
