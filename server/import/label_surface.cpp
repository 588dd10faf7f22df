#include "server/import/label_surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/imaging/label_volume.hpp"

namespace osteon::import {
namespace {

constexpr int kFieldMargin = 5;        // voxels around the bones: the reach of the filter
constexpr float kFieldUnits = 1.0e4f;  // the field as whole numbers of int16; it stays within ±3

}  // namespace

Result<imaging::HuVolume> label_field(const imaging::VoxelMask& bones, const imaging::HuVolume& grid,
                                      const std::array<int, 3>& first, const std::array<int, 3>& last,
                                      const KeepGoing& keep_going) {
  std::array<int, 3> low{}, high{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::max(0, first[axis] - kFieldMargin);
    high[axis] = std::min(bones.dims[axis] - 1, last[axis] + kFieldMargin);
  }
  imaging::LabelVolume labels;
  labels.dims = bones.dims;
  labels.spacing_mm = grid.spacing_mm;
  labels.labels = DenseVolume<std::uint8_t>({{low[0], low[1], low[2]}, {high[0], high[1], high[2]}}, 0);
  for (int slice = low[2]; slice <= high[2]; ++slice)
    for (int row = low[1]; row <= high[1]; ++row)
      for (int column = low[0]; column <= high[0]; ++column)
        labels.labels.at({column, row, slice}) = bones.at(column, row, slice);
  const auto smooth = imaging::smooth_labels(labels, {}, keep_going);
  if (!smooth) return tl::unexpected(smooth.error());

  imaging::HuVolume field;
  field.dims = {high[0] - low[0] + 1, high[1] - low[1] + 1, high[2] - low[2] + 1};
  field.spacing_mm = grid.spacing_mm;
  field.directions = grid.directions;
  field.origin_mm = grid.position_mm(Vec3(low[0], low[1], low[2]));
  field.values.reserve(field.count());
  for (int slice = low[2]; slice <= high[2]; ++slice)
    for (int row = low[1]; row <= high[1]; ++row)
      for (int column = low[0]; column <= high[0]; ++column)
        field.values.push_back(static_cast<std::int16_t>(
            std::lround(std::clamp(smooth->at({column, row, slice}), -3.0f, 3.0f) * kFieldUnits)));
  return field;
}

void restore_volume(double labelled_mm3, double pitch_mm, DenseVolume<float>& surface_mm) {
  constexpr double kMost = 0.15;  // voxels: more would be another bone
  double inside = 0, near = 0;
  for (const float s : surface_mm.values) {
    const double voxels = static_cast<double>(s) / pitch_mm;
    if (voxels > 0.5) continue;
    inside += std::min(1.0, 0.5 - voxels);
    near += voxels > -0.5 ? 1.0 : 0.0;
  }
  const double missing = labelled_mm3 / std::pow(pitch_mm, 3) - inside;
  const auto out = static_cast<float>(pitch_mm * std::clamp(missing / std::max(1.0, near), -kMost, kMost));
  const auto band = static_cast<float>(4.0 * pitch_mm);
  for (float& s : surface_mm.values)
    if (std::abs(s) < band) s = std::clamp(s - out, -band, band);
}

}  // namespace osteon::import
