#include "common/imaging/bone_field.hpp"

#include <algorithm>
#include <cmath>

#include "common/imaging/calibration.hpp"

namespace osteon::imaging {
namespace {

constexpr double kInside_hu = 200.0;                   // above the threshold: value of marrow with only bone around it
constexpr double kNearAir_hu = -200.0;                 // a neighbour below it is air, or partly air
constexpr double kLeastPart = 0.05, kMostPart = 0.95;  // of the distance between two voxels

// Position of the surface between a marrow voxel and an outside one, as a fraction of their distance.
double crossing(double marrow_hu, double outside_hu) {
  if (outside_hu >= kNearAir_hu) return 0.5;
  const double edge_hu = 0.5 * (marrow_hu + kAir_hu);
  return std::clamp((marrow_hu - edge_hu) / std::max(1.0, marrow_hu - outside_hu), kLeastPart, kMostPart);
}

}  // namespace

Result<HuVolume> bone_field(const HuVolume& volume, const VoxelMask& bones, double threshold_hu,
                            const KeepGoing& keep_going) {
  HuVolume field = volume;
  const auto [columns, rows, slices] = volume.dims;
  const auto below = static_cast<std::int16_t>(std::ceil(threshold_hu) - 1);
  const auto outside_value = [&](std::size_t i) { return static_cast<double>(std::min(volume.values[i], below)); };
  const std::array<std::ptrdiff_t, 3> step{1, columns, static_cast<std::ptrdiff_t>(columns) * rows};
  for (int slice = 0; slice < slices; ++slice) {
    if (!keep_going(static_cast<double>(slice) / slices)) return stopped_while("outlining the bone");
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        const std::size_t i = volume.index(column, row, slice);
        std::int16_t& value = field.values[i];
        if (bones.values[i] == 0) {
          value = std::min(value, below);
        } else if (value < threshold_hu) {
          // The mean over the outside neighbours of the value that gives the crossing its position on the edge to each.
          const std::array<int, 3> at{column, row, slice};
          double sum = 0.0;
          int neighbours = 0;
          for (std::size_t axis = 0; axis < 3; ++axis)
            for (const int side : {-1, 1}) {
              if (at[axis] + side < 0 || at[axis] + side >= volume.dims[axis]) continue;
              const auto beside = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(i) + side * step[axis]);
              if (bones.values[beside] != 0) continue;
              const double part = crossing(volume.values[i], volume.values[beside]);
              sum += (threshold_hu - outside_value(beside)) * part / (1.0 - part);
              ++neighbours;
            }
          const double above = neighbours > 0 ? std::max(1.0, sum / neighbours) : kInside_hu;
          value = static_cast<std::int16_t>(std::lround(std::min(32767.0, threshold_hu + above)));
        }
      }
  }
  return field;
}

}  // namespace osteon::imaging
