#include "server/import/label_surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "common/imaging/label_volume.hpp"

namespace osteon::import {
namespace {

constexpr int kFieldMargin = 5;        // voxels around the bones: the reach of the filter
constexpr float kFieldUnits = 1.0e4f;  // the field as whole numbers of int16; it stays within ±3

// Adds up how much bone a surface encloses.
class EnclosedVolume {
 public:
  explicit EnclosedVolume(double pitch_mm) : pitch_mm_(pitch_mm) {}

  void add(float surface_mm) {
    const double voxels = static_cast<double>(surface_mm) / pitch_mm_;
    if (voxels > 0.5) return;
    inside_ += std::min(1.0, 0.5 - voxels);
    near_ += voxels > -0.5 ? 1.0 : 0.0;
  }
  // How far the surface has to move outwards.
  [[nodiscard]] float missing_mm(double labelled_mm3) const {
    constexpr double kMost = 0.15;  // voxels: more would be another bone
    const double missing = labelled_mm3 / std::pow(pitch_mm_, 3) - inside_;
    return static_cast<float>(pitch_mm_ * std::clamp(missing / std::max(1.0, near_), -kMost, kMost));
  }

 private:
  double pitch_mm_, inside_ = 0, near_ = 0;  // the last two in samples
};

// Moves the surface outwards. Samples beyond the band stay.
void move_out(float out_mm, double pitch_mm, std::span<float> surface_mm) {
  const auto band = static_cast<float>(4.0 * pitch_mm);
  for (float& s : surface_mm)
    if (std::abs(s) < band) s = std::clamp(s - out_mm, -band, band);
}

CoordBox within(const CoordBox& box, Coord origin) {
  return {{std::max(box.min.x, origin.x), std::max(box.min.y, origin.y), std::max(box.min.z, origin.z)},
          {std::min(box.max.x, origin.x + kLeafSize - 1), std::min(box.max.y, origin.y + kLeafSize - 1),
           std::min(box.max.z, origin.z + kLeafSize - 1)}};
}

}  // namespace

Result<LabelField> label_field(const imaging::SparseMask& bones, const imaging::HuVolume& grid,
                               const std::array<int, 3>& first, const std::array<int, 3>& last,
                               const KeepGoing& keep_going) {
  std::array<int, 3> low{}, high{}, dims{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::max(0, first[axis] - kFieldMargin);
    high[axis] = std::min(bones.dims[axis] - 1, last[axis] + kFieldMargin);
    dims[axis] = high[axis] - low[axis] + 1;
  }
  LabelField made;
  made.bones.dims = dims;
  imaging::LabelVolume labels;
  labels.dims = bones.dims;
  labels.spacing_mm = grid.spacing_mm;
  labels.labels = DenseVolume<std::uint8_t>({{low[0], low[1], low[2]}, {high[0], high[1], high[2]}}, 0);
  for (int slice = low[2]; slice <= high[2]; ++slice)
    for (int row = low[1]; row <= high[1]; ++row)
      for (int column = low[0]; column <= high[0]; ++column) {
        const std::uint8_t bone = bones.at(column, row, slice);
        labels.labels.at({column, row, slice}) = bone;
        made.bones.values.push_back(bone);
      }
  const auto smooth = imaging::smooth_labels(labels, {}, keep_going);
  if (!smooth) return tl::unexpected(smooth.error());

  imaging::HuVolume& field = made.field;
  field.dims = dims;
  field.spacing_mm = grid.spacing_mm;
  field.directions = grid.directions;
  field.origin_mm = grid.position_mm(Vec3(low[0], low[1], low[2]));
  field.values.reserve(field.count());
  for (int slice = low[2]; slice <= high[2]; ++slice)
    for (int row = low[1]; row <= high[1]; ++row)
      for (int column = low[0]; column <= high[0]; ++column)
        field.values.push_back(static_cast<std::int16_t>(
            std::lround(std::clamp(smooth->at({column, row, slice}), -3.0f, 3.0f) * kFieldUnits)));
  return made;
}

void restore_volume(double labelled_mm3, double pitch_mm, DenseVolume<float>& surface_mm) {
  EnclosedVolume enclosed(pitch_mm);
  for (const float s : surface_mm.values) enclosed.add(s);
  move_out(enclosed.missing_mm(labelled_mm3), pitch_mm, surface_mm.values);
}

void restore_volume(double labelled_mm3, double pitch_mm, const CoordBox& box, SparseVolume& surface_mm) {
  EnclosedVolume enclosed(pitch_mm);
  const std::vector<Coord> leaves = surface_mm.leaves();
  std::vector<float> values;
  for (const std::vector<Coord>& origins : {leaves, surface_mm.constants()})
    for (const Coord origin : origins) {
      const CoordBox part = within(box, origin);
      if (part.empty()) continue;
      const Coord size = part.dims();
      values.resize(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
                    static_cast<std::size_t>(size.z));
      surface_mm.gather(part, values);
      for (const float s : values) enclosed.add(s);
    }
  const float out_mm = enclosed.missing_mm(labelled_mm3);
  for (const Coord origin : leaves) move_out(out_mm, pitch_mm, {surface_mm.edit_leaf(origin), kLeafVoxels});
}

}  // namespace osteon::import
