#include "server/import/case_samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/imaging/resample.hpp"
#include "server/import/scan_ends.hpp"

namespace osteon::import {
namespace {

constexpr std::ptrdiff_t kNoVoxel = -1;

// Calls `visit` with every sample of the box and its index among those of `part`.
template <class Visit>
void each_sample(const CoordBox& box, const CoordBox& part, Visit visit) {
  const Coord dims = part.dims();
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y) {
      const std::size_t row =
          (to_index(x - part.min.x) * to_index(dims.y) + to_index(y - part.min.y)) * to_index(dims.z);
      for (int z = box.min.z; z <= box.max.z; ++z) visit(Coord{x, y, z}, row + to_index(z - part.min.z));
    }
}

}  // namespace

CaseSamples::CaseSamples(const SampleSource& source, SparseVolume& surface_mm, double pitch_mm)
    : from_(source), surface_mm_(surface_mm), pitch_mm_(pitch_mm), band_(static_cast<float>(4.0 * pitch_mm)) {}

PartKind CaseSamples::fill(const CoordBox& part, PartSamples& to) {
  if (!surface_mm_.any_stored(part)) return PartKind::outside;
  surface_mm_.gather(part, to.surface_mm);
  const Coord first = floor_to(part.min, kLeafSize);
  const auto each_leaf = [&](auto visit) {
    for (int x = first.x; x <= part.max.x; x += kLeafSize)
      for (int y = first.y; y <= part.max.y; y += kLeafSize)
        for (int z = first.z; z <= part.max.z; z += kLeafSize) visit(Coord{x, y, z});
  };
  each_leaf([&](Coord origin) { surface_mm_.set_constant(origin, band_); });
  cap_at_scan(from_.scan, part, pitch_mm_, band_, to.surface_mm);
  if (std::ranges::all_of(to.surface_mm, [&](float s) { return s >= band_; })) return PartKind::outside;

  std::ranges::fill(to.density_g_cm3, 0.0f);
  if (from_.several) to.bone.assign(to.surface_mm.size(), 0);
  if (from_.known_tissue) to.tissue.assign(to.surface_mm.size(), Tissue::none);
  each_leaf([&](Coord origin) { fill_leaf(origin, part, to); });
  return PartKind::samples;
}

void CaseSamples::fill_leaf(Coord origin, const CoordBox& part, PartSamples& to) {
  const CoordBox box{{std::max(origin.x, part.min.x), std::max(origin.y, part.min.y), std::max(origin.z, part.min.z)},
                     {std::min(origin.x + kLeafSize - 1, part.max.x), std::min(origin.y + kLeafSize - 1, part.max.y),
                      std::min(origin.z + kLeafSize - 1, part.max.z)}};
  bool near = false;
  each_sample(box, part, [&](Coord, std::size_t i) { near = near || to.surface_mm[i] < band_; });
  if (!near) return;
  const Coord size = box.dims();
  hu_.resize(to_index(size.x) * to_index(size.y) * to_index(size.z));
  imaging::resample(from_.volume, from_.hu_box, from_.hu, box, pitch_mm_, hu_);
  if (from_.change_hu != nullptr && from_.change_hu->any_stored(box)) {
    change_hu_.resize(hu_.size());
    from_.change_hu->gather(box, change_hu_);
    for (std::size_t i = 0; i < hu_.size(); ++i) hu_[i] += change_hu_[i];
  }
  std::size_t n = 0;
  each_sample(box, part, [&](Coord c, std::size_t i) {
    to.density_g_cm3[i] =
        static_cast<float>(imaging::bone_density_g_cm3(from_.calibration, static_cast<double>(hu_[n++])));
    if (to.surface_mm[i] >= 0.0f || (to.bone.empty() && to.tissue.empty())) return;
    const std::ptrdiff_t voxel = label_voxel(position_mm(c, pitch_mm_));
    if (voxel == kNoVoxel) return;
    const auto v = static_cast<std::size_t>(voxel);
    const std::uint8_t label = from_.kept.labels[v];
    if (!to.bone.empty()) to.bone[i] = label;
    const auto tissue = static_cast<Tissue>(from_.kept.tissue[v]);
    // The density says as much of the others.
    if (!to.tissue.empty() && (tissue == Tissue::metal || tissue == Tissue::enamel || from_.tissue_labels[label]))
      to.tissue[i] = tissue;
  });
}

// The kept voxel from which a sample in bone takes its labels: the nearest one. If that is not bone, as near the
// surface, any voxel of bone of the cell, or else any beside the nearest. kNoVoxel: none of them is bone.
std::ptrdiff_t CaseSamples::label_voxel(const Vec3& position_mm) const {
  const Vec3 at = from_.volume.voxel(position_mm);
  const auto clamped = [&](double c, std::size_t axis) {
    return std::clamp(static_cast<int>(c), 0, from_.volume.dims[axis] - 1);
  };
  const auto bone_at = [&](int column, int row, int slice) {
    if (!from_.kept_box.contains({{column, row, slice}, {column, row, slice}})) return kNoVoxel;
    const std::size_t i = from_.kept_box.index(column, row, slice);
    return from_.bone_labels[from_.kept.labels[i]] ? static_cast<std::ptrdiff_t>(i) : kNoVoxel;
  };
  const std::array<int, 3> nearest{clamped(std::round(at.x()), 0), clamped(std::round(at.y()), 1),
                                   clamped(std::round(at.z()), 2)};
  std::ptrdiff_t found = bone_at(nearest[0], nearest[1], nearest[2]);
  for (int corner = 0; corner < 8 && found == kNoVoxel; ++corner)
    found = bone_at(clamped(std::floor(at.x()) + (corner & 1), 0), clamped(std::floor(at.y()) + (corner >> 1 & 1), 1),
                    clamped(std::floor(at.z()) + (corner >> 2), 2));
  // The surface of labels may lie a part of a voxel beyond the cell.
  for (int beside = 0; beside < 27 && found == kNoVoxel; ++beside)
    found = bone_at(nearest[0] + beside % 3 - 1, nearest[1] + beside / 3 % 3 - 1, nearest[2] + beside / 9 - 1);
  return found;
}

}  // namespace osteon::import
