#include "common/imaging/hu_volume.hpp"

#include <algorithm>
#include <cstdio>

#include "common/core/freed_memory.hpp"

namespace osteon::imaging {

std::string describe(const HuVolume& volume) {
  char text[128];
  std::snprintf(text, sizeof text, "%dx%dx%d, %.3gx%.3gx%.3g mm", volume.dims[0], volume.dims[1], volume.dims[2],
                volume.spacing_mm.x(), volume.spacing_mm.y(), volume.spacing_mm.z());
  return text;
}

Result<HuVolume> cropped(HuVolume volume, const std::array<int, 3>& first, const std::array<int, 3>& last,
                         const KeepGoing& keep_going) {
  HuVolume part;
  part.spacing_mm = volume.spacing_mm;
  part.directions = volume.directions;
  part.origin_mm = volume.position_mm(Vec3(first[0], first[1], first[2]));
  for (std::size_t axis = 0; axis < 3; ++axis) part.dims[axis] = last[axis] - first[axis] + 1;
  // Rows of voxels only move towards the beginning, so the memory can be reused.
  std::int16_t* to = volume.values.data();
  for (int slice = first[2]; slice <= last[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice - first[2]) / part.dims[2])) return stopped_while("cropping the scan");
    for (int row = first[1]; row <= last[1]; ++row) {
      const std::int16_t* from = volume.values.data() + volume.index(first[0], row, slice);
      to = std::copy(from, from + part.dims[0], to);
    }
  }
  volume.values.resize(part.count());
  give_back_unused(volume.values);
  part.values = std::move(volume.values);
  return part;
}

Box enclosing_box(const HuVolume& volume, const Vec3& first, const Vec3& last) {
  Box box;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 voxel((corner & 1) != 0 ? last.x() : first.x(), (corner & 2) != 0 ? last.y() : first.y(),
                     (corner & 4) != 0 ? last.z() : first.z());
    box.include(volume.position_mm(voxel));
  }
  return box;
}

double outside_scan_mm(const HuVolume& volume, const Vec3& position_mm) {
  const Vec3 voxel = volume.voxel(position_mm);
  Vec3 beyond;
  for (int axis = 0; axis < 3; ++axis) {
    const double half = 0.5 * volume.dims[static_cast<std::size_t>(axis)];
    beyond[axis] = (std::abs(voxel[axis] + 0.5 - half) - half) * volume.spacing_mm[axis];
  }
  return beyond.maxCoeff();
}

}  // namespace osteon::imaging
