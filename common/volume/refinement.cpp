#include "common/volume/refinement.hpp"

#include <algorithm>
#include <set>
#include <unordered_map>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/solid_labels.hpp"

namespace osteon {
namespace {

CoordBox sub_volume_box(Coord origin, int level) {
  const Coord first = (1 << level) * origin;
  const std::int32_t n = (kSubVolumeSamples << level) - 1;
  return {first, first + Coord{n, n, n}};
}

}  // namespace

SubVolumeField::SubVolumeField(Case bone, int level, std::shared_ptr<const ToolBox> tools)
    : field_(std::move(bone), {}, std::move(tools)), level_(level) {
  OSTEON_CHECK(level >= 0 && level < kLevels);
}

RefineReport SubVolumeField::apply(const Cut& cut) {
  OSTEON_CHECK(cut.level == level_);
  RefineReport report;
  // The cut reports which leaves it reached, so its path through the bone is computed once. The resampling afterwards
  // does not change leaves that the cut has made.
  report.cut = field_.apply(cut);
  std::set<Coord> touched;
  for (const Coord leaf : report.cut.reached_leaves)
    touched.insert(floor_to(shift_down(leaf, level_), kSubVolumeSamples));
  for (const Coord origin : touched) {
    if (surface_.contains(origin)) continue;
    resample(origin);
    ++report.resampled;
  }
  return report;
}

void SubVolumeField::resample(Coord origin) {
  const CoordBox box = sub_volume_box(origin, level_);
  const std::int32_t n = box.dims().x;
  std::vector<float>& surface = surface_[origin];
  surface.resize(to_index(n) * to_index(n) * to_index(n));
  field_.gather_surface(level_, box, surface);
  const std::int32_t band = band_quanta(level_pitch_mm(field_.bone().pitch_mm(), level_));
  FieldLeaf leaf{field_.body(), level_, {}, std::vector<std::int16_t>(kLeafVoxels, static_cast<std::int16_t>(band))};
  for (std::int32_t x = box.min.x; x <= box.max.x; x += kLeafSize)
    for (std::int32_t y = box.min.y; y <= box.max.y; y += kLeafSize)
      for (std::int32_t z = box.min.z; z <= box.max.z; z += kLeafSize) {
        leaf.origin = {x, y, z};
        const Coord last = leaf.origin + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1};
        if (field_.has_cuts(level_, {leaf.origin, last})) continue;
        // Neither method stores leaves without bone.
        if (field_.bone().has_bone({shift_down(leaf.origin, level_), shift_down(last, level_) + Coord{1, 1, 1}}))
          field_.restore(leaf);
      }
}

void SubVolumeField::gather_solid(const CoordBox& box, std::span<float> out) const {
  const Coord dims = box.dims();
  OSTEON_CHECK(out.size() == to_index(dims.x) * to_index(dims.y) * to_index(dims.z));
  // If the whole box was resampled, nothing is interpolated.
  const Coord first = floor_to(shift_down(box.min, level_), kSubVolumeSamples), last = shift_down(box.max, level_);
  std::vector<float> cuts;
  for (std::int32_t sx = first.x; sx <= last.x; sx += kSubVolumeSamples)
    for (std::int32_t sy = first.y; sy <= last.y; sy += kSubVolumeSamples)
      for (std::int32_t sz = first.z; sz <= last.z; sz += kSubVolumeSamples) {
        const auto found = surface_.find({sx, sy, sz});
        const CoordBox sub = sub_volume_box({sx, sy, sz}, level_);
        const CoordBox part{
            {std::max(sub.min.x, box.min.x), std::max(sub.min.y, box.min.y), std::max(sub.min.z, box.min.z)},
            {std::min(sub.max.x, box.max.x), std::min(sub.max.y, box.max.y), std::min(sub.max.z, box.max.z)}};
        const Coord d = part.dims();
        cuts.resize(to_index(d.x) * to_index(d.y) * to_index(d.z));
        if (found == surface_.end())
          field_.gather_solid(level_, part, cuts);
        else
          field_.gather_cuts(level_, part, cuts);
        const std::int32_t n = sub.dims().x;
        const float band = band_mm(level_pitch_mm(field_.bone().pitch_mm(), level_));
        std::size_t i = 0;
        for (std::int32_t x = part.min.x; x <= part.max.x; ++x)
          for (std::int32_t y = part.min.y; y <= part.max.y; ++y) {
            float* row = out.data() +
                         (to_index(x - box.min.x) * to_index(dims.y) + to_index(y - box.min.y)) * to_index(dims.z) +
                         to_index(part.min.z - box.min.z);
            if (found == surface_.end()) {
              std::copy_n(cuts.data() + i, d.z, row);
              i += to_index(d.z);
              continue;
            }
            const float* s = found->second.data() +
                             (to_index(x - sub.min.x) * to_index(n) + to_index(y - sub.min.y)) * to_index(n) +
                             to_index(part.min.z - sub.min.z);
            for (std::int32_t z = 0; z < d.z; ++z, ++i) row[z] = cuts[i] < band ? std::max(s[z], -cuts[i]) : s[z];
          }
      }
}

std::vector<Coord> SubVolumeField::sub_volumes() const {
  std::vector<Coord> origins;
  for (const auto& [origin, surface] : surface_) origins.push_back(origin);
  return origins;
}

std::size_t SubVolumeField::memory_bytes() const {
  std::size_t bytes = field_.memory_bytes();
  for (const auto& [origin, surface] : surface_) bytes += surface.size() * sizeof(float);
  return bytes;
}

std::size_t unconnected_areas(std::span<const Coord> origins, std::int32_t size) {
  std::unordered_map<Coord, std::uint32_t, CoordHash> places;
  UnionFind sets;
  for (const Coord origin : origins)
    if (!places.contains(origin)) places.emplace(origin, sets.add());
  for (const auto& [origin, place] : places)
    for (int around = 0; around < 27; ++around) {
      const auto next = places.find(origin + size * Coord{around / 9 - 1, around / 3 % 3 - 1, around % 3 - 1});
      if (next != places.end()) sets.unite(place, next->second);
    }
  std::set<std::uint32_t> roots;
  for (const auto& [origin, place] : places) roots.insert(sets.find(place));
  return roots.size();
}

}  // namespace osteon
