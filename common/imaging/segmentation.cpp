#include "common/imaging/segmentation.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/imaging/cancellous.hpp"
#include "common/imaging/enclosed.hpp"

namespace osteon::imaging {
namespace {

constexpr double kThresholdEnd = 0.05, kCancellousEnd = 0.35, kEnclosedEnd = 0.9;  // fractions of the time
constexpr int kFewest = 3;  // voxels needed to decide whether a space contains air; fewer are noise within bone
constexpr double kAirEdge_voxels = 2.0;  // width over which a scanner blurs the edge between air and bone

// Mean HU of a voxel and its neighbours that are not dense. The air of a sinus is darker than marrow even if it is
// noisy.
bool is_air(const HuVolume& volume, const VoxelMask& dense, std::array<int, 3> c, double air_hu) {
  double sum = 0.0;
  int count = 0;
  for (int z = std::max(0, c[2] - 1); z <= std::min(volume.dims[2] - 1, c[2] + 1); ++z)
    for (int y = std::max(0, c[1] - 1); y <= std::min(volume.dims[1] - 1, c[1] + 1); ++y)
      for (int x = std::max(0, c[0] - 1); x <= std::min(volume.dims[0] - 1, c[0] + 1); ++x)
        if (dense.at(x, y, z) == 0) {
          sum += volume.at(x, y, z);
          ++count;
        }
  return count >= kFewest && sum < air_hu * count;
}

// Removes spaces that contain air from the enclosed ones, with the blurred edge around them.
Result<void> remove_air(const HuVolume& volume, const VoxelMask& dense, double air_hu, VoxelMask& enclosed,
                        const KeepGoing& keep_going) {
  VoxelMask air(volume.dims);
  bool any = false;
  for (int slice = 0; slice < volume.dims[2]; ++slice) {
    if (!keep_going(0.5 * slice / volume.dims[2])) return stopped_while("looking for the bone");
    for (int row = 0; row < volume.dims[1]; ++row)
      for (int column = 0; column < volume.dims[0]; ++column)
        if (enclosed.at(column, row, slice) != 0 && is_air(volume, dense, {column, row, slice}, air_hu)) {
          air.at(column, row, slice) = 1;
          any = true;
        }
  }
  if (!any) return {};
  const auto around = within_mm(air, Vec3::Ones(), kAirEdge_voxels, part(keep_going, 0.5, 1.0));
  if (!around) return tl::unexpected(around.error());
  for (std::size_t i = 0; i < enclosed.values.size(); ++i)
    if (around->values[i] != 0) enclosed.values[i] = 0;
  return {};
}

}  // namespace

Result<VoxelMask> dense_voxels(const HuVolume& volume, double threshold_hu, const KeepGoing& keep_going) {
  VoxelMask dense(volume.dims);
  const std::size_t area = static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]);
  bool any = false;
  for (int slice = 0; slice < volume.dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / volume.dims[2])) return stopped_while("looking for the bone");
    const std::size_t begin = volume.index(0, 0, slice);
    for (std::size_t i = begin; i < begin + area; ++i) {
      const bool is_dense = volume.values[i] >= threshold_hu;
      dense.values[i] = is_dense ? 1 : 0;
      any = any || is_dense;
    }
  }
  if (!any)
    return failure(ErrorCode::invalid_input, "no voxel reaches the bone threshold of " +
                                                 std::to_string(std::lround(threshold_hu)) +
                                                 " HU; give a lower --threshold");
  return dense;
}

Result<VoxelMask> segment_bone(const HuVolume& volume, const SegmentationParams& params, const ScanEnds& ends,
                               const KeepGoing& keep_going) {
  auto dense = dense_voxels(volume, params.threshold_hu, part(keep_going, 0.0, kThresholdEnd));
  if (!dense) return dense;
  return segment_bone(volume, std::move(*dense), params, ends, keep_going);
}

Result<VoxelMask> segment_bone(const HuVolume& volume, VoxelMask dense, const SegmentationParams& params,
                               const ScanEnds& ends, const KeepGoing& keep_going) {
  if (params.hollow) return dense;

  VoxelMask solid;
  if (params.cancellous_hu < params.threshold_hu) {
    auto cancellous = cancellous_between(volume, dense, params, part(keep_going, kThresholdEnd, kCancellousEnd));
    if (!cancellous) return cancellous;
    solid = std::move(*cancellous);
    for (std::size_t i = 0; i < solid.values.size(); ++i)
      solid.values[i] |= dense.values[i] == mask_value(BoneVoxel::dense) ? 1 : 0;
  } else {
    solid = dense;
    std::ranges::replace(solid.values, mask_value(BoneVoxel::contrast), mask_value(BoneVoxel::none));
  }
  auto enclosed = enclosed_by(solid, volume.spacing_mm, params, ends, part(keep_going, kCancellousEnd, kEnclosedEnd));
  if (!enclosed) return enclosed;
  if (auto opened = remove_air(volume, dense, params.air_hu, *enclosed, part(keep_going, kEnclosedEnd, 1.0)); !opened)
    return tl::unexpected(opened.error());

  for (std::size_t i = 0; i < solid.values.size(); ++i) {
    if (dense.values[i] != 0) {
      solid.values[i] = dense.values[i];
      continue;
    }
    const BoneVoxel kind = solid.values[i] != 0       ? BoneVoxel::cancellous
                           : enclosed->values[i] != 0 ? BoneVoxel::marrow
                                                      : BoneVoxel::none;
    solid.values[i] = mask_value(kind);
  }
  return solid;
}

}  // namespace osteon::imaging
