#include "common/imaging/moved_volume.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"
#include "common/imaging/resample.hpp"

namespace osteon::imaging {
namespace {

// `value_at` is called with the voxel coordinates of `moving`, which are within it.
template <class Value, class ValueAt>
Result<std::vector<Value>> moved(const HuVolume& fixed, const HuVolume& moving, const Pose& pose_fixed_moving,
                                 Value beyond, ValueAt value_at, const KeepGoing& keep_going) {
  const Pose pose_moving_fixed = pose_fixed_moving.inverse();
  const auto voxel_at = [&](int column, int row, int slice) {
    return moving.voxel(pose_moving_fixed.point(fixed.position_mm(Vec3(column, row, slice))));
  };
  const Vec3 step = voxel_at(1, 0, 0) - voxel_at(0, 0, 0);
  const Vec3 most(moving.dims[0] - 0.5, moving.dims[1] - 0.5, moving.dims[2] - 0.5);
  std::vector<Value> values(fixed.count(), beyond);
  Value* value = values.data();
  for (int slice = 0; slice < fixed.dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / fixed.dims[2])) return stopped_while("moving the scan");
    for (int row = 0; row < fixed.dims[1]; ++row) {
      const Vec3 first = voxel_at(0, row, slice);
      for (int column = 0; column < fixed.dims[0]; ++column, ++value) {
        const Vec3 at = first + column * step;
        if ((at.array() >= -0.5).all() && (at.array() < most.array()).all()) *value = value_at(at);
      }
    }
  }
  if (!keep_going(1.0)) return stopped_while("moving the scan");
  return values;
}

}  // namespace

Result<std::vector<std::int16_t>> moved_hu(const HuVolume& fixed, const HuVolume& moving, const Pose& pose_fixed_moving,
                                           const KeepGoing& keep_going) {
  return moved(
      fixed, moving, pose_fixed_moving, kBeyondScan_hu,
      [&](const Vec3& at) { return static_cast<std::int16_t>(std::lround(hu_at(moving, at))); }, keep_going);
}

Result<std::vector<std::uint16_t>> moved_labels(const HuVolume& fixed, const HuVolume& moving,
                                                const std::vector<std::uint16_t>& labels, const Pose& pose_fixed_moving,
                                                const KeepGoing& keep_going) {
  OSTEON_CHECK(labels.size() == moving.count());
  // Truncation rounds: no coordinate is below -0.5. The largest number below 0.5 and 0.5 have the sum 1.
  const auto nearest = [&](double at, std::size_t axis) {
    return std::min(static_cast<int>(at + 0.5), moving.dims[axis] - 1);
  };
  return moved(
      fixed, moving, pose_fixed_moving, std::uint16_t{0},
      [&](const Vec3& at) { return labels[moving.index(nearest(at.x(), 0), nearest(at.y(), 1), nearest(at.z(), 2))]; },
      keep_going);
}

}  // namespace osteon::imaging
