#include "common/imaging/bone_field.hpp"

#include <algorithm>
#include <cmath>

#include "common/imaging/calibration.hpp"

namespace osteon::imaging {
namespace {

constexpr double kInside_hu = 200.0;                   // above the threshold: value of marrow with only bone around it
constexpr double kNearAir_hu = -200.0;                 // a neighbour below it is air, or partly air
constexpr double kLeastPart = 0.05, kMostPart = 0.95;  // of the distance between two voxels

constexpr int kBrick = 8;

// Position of the surface between a marrow voxel and an outside one, as a fraction of their distance.
double crossing(double marrow_hu, double outside_hu) {
  if (outside_hu >= kNearAir_hu) return 0.5;
  const double edge_hu = 0.5 * (marrow_hu + kAir_hu);
  return std::clamp((marrow_hu - edge_hu) / std::max(1.0, marrow_hu - outside_hu), kLeastPart, kMostPart);
}

}  // namespace

BoneField::BoneField(const HuVolume& volume, const SparseMask& bones, const SurfaceLevel& level)
    : volume_(volume),
      bones_(bones),
      level_(level),
      below_(static_cast<std::int16_t>(std::ceil(level.threshold_hu) - 1)) {
  for (std::size_t axis = 0; axis < 3; ++axis) bricks_[axis] = (volume.dims[axis] + kBrick - 1) / kBrick;
}

Result<BoneField> BoneField::make(const HuVolume& volume, const SparseMask& bones, const SurfaceLevel& level,
                                  const KeepGoing& keep_going) {
  BoneField field(volume, bones, level);
  const auto [columns, rows, slices] = volume.dims;
  const VoxelMask places(field.bricks_);
  std::vector<bool> any(places.values.size(), false), all(places.values.size(), true);
  for (int slice = 0; slice < slices; ++slice) {
    if (!keep_going(static_cast<double>(slice) / slices)) return stopped_while("looking for the bone's surface");
    for (int row = 0; row < rows; ++row)
      for (int first = 0; first < columns; first += kBrick) {
        const std::size_t voxel = volume.index(first, row, slice);
        const int count = std::min(kBrick, columns - first);
        int kept = 0;
        for (int i = 0; i < count; ++i) kept += bones.values[voxel + static_cast<std::size_t>(i)] != 0 ? 1 : 0;
        const std::size_t brick = places.index(first / kBrick, row / kBrick, slice / kBrick);
        any[brick] = any[brick] || kept > 0;
        all[brick] = all[brick] && kept == count;
      }
  }
  for (std::size_t i = 0; i < any.size(); ++i)
    field.brick_.push_back(all[i] ? Inside::all : any[i] ? Inside::some : Inside::none);
  return field;
}

Inside BoneField::inside(const VoxelBox& part) const {
  const auto brick = [&](int x, int y, int z) {
    return brick_[(static_cast<std::size_t>(z) * static_cast<std::size_t>(bricks_[1]) + static_cast<std::size_t>(y)) *
                      static_cast<std::size_t>(bricks_[0]) +
                  static_cast<std::size_t>(x)];
  };
  bool any = false, all = true;
  for (int z = part.first[2] / kBrick; z <= part.last[2] / kBrick; ++z)
    for (int y = part.first[1] / kBrick; y <= part.last[1] / kBrick; ++y)
      for (int x = part.first[0] / kBrick; x <= part.last[0] / kBrick; ++x) {
        any = any || brick(x, y, z) != Inside::none;
        all = all && brick(x, y, z) == Inside::all;
      }
  if (!any) return Inside::none;
  if (all) return Inside::all;
  // The part may still lie on one side within its bricks.
  any = false;
  all = true;
  for (int slice = part.first[2]; slice <= part.last[2]; ++slice)
    for (int row = part.first[1]; row <= part.last[1]; ++row) {
      const std::size_t voxel = volume_.index(part.first[0], row, slice);
      for (int i = 0; i < part.dim(0); ++i) {
        const bool kept = bones_.values[voxel + static_cast<std::size_t>(i)] != 0;
        any = any || kept;
        all = all && kept;
      }
      if (any && !all) return Inside::some;
    }
  return all ? Inside::all : Inside::none;
}

// The mean over the outside neighbours of the value that gives the crossing its position on the edge to each.
std::int16_t BoneField::marrow_value(const std::array<int, 3>& at, std::size_t i) const {
  const std::array<std::ptrdiff_t, 3> step{1, volume_.dims[0],
                                           static_cast<std::ptrdiff_t>(volume_.dims[0]) * volume_.dims[1]};
  double sum = 0.0;
  int neighbours = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1}) {
      if (at[axis] + side < 0 || at[axis] + side >= volume_.dims[axis]) continue;
      const auto beside = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(i) + side * step[axis]);
      if (bones_.values[beside] != 0) continue;
      const double part = crossing(volume_.values[i], volume_.values[beside]);
      const double outside = std::min(level_.lowered(volume_, beside), below_);
      sum += (level_.threshold_hu - outside) * part / (1.0 - part);
      ++neighbours;
    }
  const double above = neighbours > 0 ? std::max(1.0, sum / neighbours) : kInside_hu;
  return nearest_hu(level_.threshold_hu + above);
}

// For a dense voxel beside dense bone that is kept: as far below the threshold as the mean of these is above it.
std::int16_t BoneField::outside_value(const std::array<int, 3>& at, std::size_t i) const {
  const std::int16_t hu = level_.lowered(volume_, i);
  if (hu <= below_) return hu;
  const std::array<std::ptrdiff_t, 3> step{1, volume_.dims[0],
                                           static_cast<std::ptrdiff_t>(volume_.dims[0]) * volume_.dims[1]};
  double above = 0.0;
  int neighbours = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1}) {
      if (at[axis] + side < 0 || at[axis] + side >= volume_.dims[axis]) continue;
      const auto beside = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(i) + side * step[axis]);
      const std::int16_t beside_hu = level_.lowered(volume_, beside);
      if (bones_.values[beside] == 0 || beside_hu < level_.threshold_hu) continue;
      above += beside_hu - level_.threshold_hu;
      ++neighbours;
    }
  if (neighbours == 0) return below_;
  const double value = level_.threshold_hu - std::max(1.0, above / neighbours);
  return nearest_hu(value);
}

void BoneField::read(const VoxelBox& part, std::span<std::int16_t> values) const {
  std::size_t n = 0;
  for (int slice = part.first[2]; slice <= part.last[2]; ++slice)
    for (int row = part.first[1]; row <= part.last[1]; ++row)
      for (int column = part.first[0]; column <= part.last[0]; ++column) {
        const std::size_t i = volume_.index(column, row, slice);
        const std::int16_t hu = level_.lowered(volume_, i);
        values[n++] = bones_.values[i] == 0      ? outside_value({column, row, slice}, i)
                      : hu < level_.threshold_hu ? marrow_value({column, row, slice}, i)
                                                 : hu;
      }
}

}  // namespace osteon::imaging
