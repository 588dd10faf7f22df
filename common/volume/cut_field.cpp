#include "common/volume/cut_field.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/sparse_volume.hpp"

namespace osteon {

struct CutField::Grids {
  Case bone;
  BodyId body;
  std::shared_ptr<const ToolBox> tools;
  std::array<SparseVolume, kLevels> cuts;  // R of each level
};

namespace {

std::size_t count(const CoordBox& box) {
  const Coord d = box.dims();
  return static_cast<std::size_t>(d.x) * static_cast<std::size_t>(d.y) * static_cast<std::size_t>(d.z);
}

// Samples of level 0 around a box of samples of `level`.
CoordBox coarse_box(const CoordBox& box, int level) {
  return {shift_down(box.min, level), shift_down(box.max, level) + Coord{1, 1, 1}};
}

// Linear interpolation from a coarser lattice, one axis at a time: `fine` samples per coarse one.
void interpolate(const CoordBox& coarse, std::span<const float> from, const CoordBox& box, int shift, std::span<float> out) {
  const std::int32_t fine = 1 << shift, mask = fine - 1;
  const float step = 1.0f / static_cast<float>(fine);
  const Coord cd = coarse.dims();
  const std::size_t sx = static_cast<std::size_t>(cd.y) * static_cast<std::size_t>(cd.z), sy = static_cast<std::size_t>(cd.z);
  std::size_t i = 0;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x) {
    const float wx = static_cast<float>(x & mask) * step;
    const std::size_t ix = static_cast<std::size_t>((x >> shift) - coarse.min.x) * sx;
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y) {
      const float wy = static_cast<float>(y & mask) * step;
      const std::size_t iy = ix + static_cast<std::size_t>((y >> shift) - coarse.min.y) * sy;
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z, ++i) {
        const float wz = static_cast<float>(z & mask) * step;
        const float* p = from.data() + iy + static_cast<std::size_t>((z >> shift) - coarse.min.z);
        const auto along_z = [&](const float* q) { return q[0] + wz * (q[1] - q[0]); };
        const float near_y = along_z(p) + wy * (along_z(p + sy) - along_z(p));
        const float far_y = along_z(p + sx) + wy * (along_z(p + sx + sy) - along_z(p + sx));
        out[i] = near_y + wx * (far_y - near_y);
      }
    }
  }
}

// R of one level on the samples of another: interpolated where the other is finer, every nth sample where coarser.
void gather_at_level(const SparseVolume& cuts, int from_level, int level, const CoordBox& box, std::span<float> out) {
  if (from_level == level) {
    cuts.gather(box, out);
    return;
  }
  if (from_level < level) {
    const int shift = level - from_level;
    const CoordBox coarse = coarse_box(box, shift);
    std::vector<float> samples(count(coarse));
    cuts.gather(coarse, samples);
    interpolate(coarse, samples, box, shift, out);
    return;
  }
  const std::int32_t fine = 1 << (from_level - level);
  std::size_t i = 0;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) out[i++] = cuts.value({x * fine, y * fine, z * fine});
}

bool any_cut(const SparseVolume& cuts, const CoordBox& box) {
  const Coord first = floor_to(box.min, kLeafSize);
  for (std::int32_t x = first.x; x <= box.max.x; x += kLeafSize)
    for (std::int32_t y = first.y; y <= box.max.y; y += kLeafSize)
      for (std::int32_t z = first.z; z <= box.max.z; z += kLeafSize)
        if (cuts.leaf({x, y, z}) || cuts.value({x, y, z}) < cuts.background()) return true;
  return false;
}

std::int16_t to_quanta(float mm) { return static_cast<std::int16_t>(std::lround(mm * 1024.0f)); }

}  // namespace

CutField::CutField(Case bone, BodyId body, std::shared_ptr<const ToolBox> tools) {
  const double h = bone.pitch_mm();
  grids_ = std::make_unique<Grids>(Grids{std::move(bone), body, std::move(tools),
                                         {SparseVolume(band_mm(level_pitch_mm(h, 0))), SparseVolume(band_mm(level_pitch_mm(h, 1))),
                                          SparseVolume(band_mm(level_pitch_mm(h, 2)))}});
}
CutField::~CutField() = default;
CutField::CutField(CutField&&) noexcept = default;
CutField& CutField::operator=(CutField&&) noexcept = default;

const Case& CutField::bone() const { return grids_->bone; }
const std::shared_ptr<const ToolBox>& CutField::tools() const { return grids_->tools; }

CutReport CutField::apply(const Cut& cut) {
  OSTEON_CHECK(cut.body == grids_->body);
  SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(cut.level)];
  const ToolBox::Entry* tool = grids_->tools->find(cut.tool);
  OSTEON_CHECK(tool != nullptr && tool->body.cuts());
  const SweptTool swept(cut, tool->body, grids_->bone.pitch_mm());
  CutReport report;
  report.level = cut.level;
  std::array<float, kLeafVoxels> scratch;
  for (const Coord origin : swept.leaves()) {
    report.visited += kLeafVoxels;
    const float* old = cuts.leaf(origin);
    if (!old) {
      // Whether a leaf is kept depends on the case and its place only, never on earlier cuts.
      const CoordBox leaf_box{origin, origin + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1}};
      if (cuts.value(origin) != cuts.background() || !grids_->bone.has_bone(coarse_box(leaf_box, cut.level))) continue;
      scratch.fill(cuts.background());
    } else {
      std::copy_n(old, kLeafVoxels, scratch.begin());
    }
    report.computed += kLeafVoxels;
    const int modified = swept.cut_leaf(origin, scratch);
    if (modified == 0) continue;
    report.modified += modified;
    report.changed_leaves.push_back(origin);
    const float removed = -cuts.background();
    if (std::ranges::all_of(scratch, [&](float v) { return v == removed; })) {
      cuts.set_constant(origin, removed);
    } else {
      std::ranges::copy(scratch, cuts.edit_leaf(origin));
    }
  }
  return report;
}

void CutField::restore(const FieldLeaf& leaf) {
  OSTEON_CHECK(leaf.level >= 0 && leaf.level < kLevels && leaf.values.size() == kLeafVoxels);
  SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(leaf.level)];
  const std::int16_t removed = to_quanta(-cuts.background());
  if (std::ranges::all_of(leaf.values, [&](std::int16_t v) { return v == removed; })) {
    cuts.set_constant(leaf.origin, -cuts.background());
    return;
  }
  std::ranges::transform(leaf.values, cuts.edit_leaf(leaf.origin),
                         [](std::int16_t v) { return static_cast<float>(v) * static_cast<float>(kQuantum_mm); });
}

bool CutField::merge(const FieldLeaf& mask) {
  OSTEON_CHECK(mask.level >= 0 && mask.level < kLevels && mask.values.size() == kLeafVoxels);
  FieldLeaf merged{mask.body, mask.level, mask.origin, {}};
  read(merged);
  bool changed = false;
  for (std::size_t i = 0; i < mask.values.size(); ++i) {
    changed |= mask.values[i] < merged.values[i];
    merged.values[i] = std::min(merged.values[i], mask.values[i]);
  }
  if (changed) restore(merged);
  return changed;
}

std::vector<FieldLeaf> CutField::leaves() const {
  std::vector<FieldLeaf> all = leaf_places();
  for (FieldLeaf& leaf : all) read(leaf);
  return all;
}

std::vector<FieldLeaf> CutField::leaf_places() const {
  std::vector<FieldLeaf> all;
  for (int level = 0; level < kLevels; ++level) {
    const SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(level)];
    const std::size_t first = all.size();
    for (const auto& origins : {cuts.leaves(), cuts.constants()})
      for (const Coord origin : origins) all.push_back({grids_->body, level, origin, {}});
    std::sort(all.begin() + static_cast<std::ptrdiff_t>(first), all.end(),
              [](const FieldLeaf& a, const FieldLeaf& b) { return a.origin < b.origin; });
  }
  return all;
}

void CutField::read(FieldLeaf& leaf) const {
  const SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(leaf.level)];
  leaf.values.resize(kLeafVoxels);
  if (const float* values = cuts.leaf(leaf.origin))
    std::ranges::transform(std::span(values, kLeafVoxels), leaf.values.begin(), to_quanta);
  else
    std::ranges::fill(leaf.values, to_quanta(cuts.value(leaf.origin)));
}

Digest CutField::hash() const { return field_hash(leaves(), grids_->bone.pitch_mm()); }

bool CutField::has_cuts(int level, const CoordBox& box) const {
  return any_cut(grids_->cuts[static_cast<std::size_t>(level)], box);
}

void CutField::gather_cuts(int level, const CoordBox& box, std::span<float> out) const {
  grids_->cuts[static_cast<std::size_t>(level)].gather(box, out);
}

void CutField::gather_surface(int level, const CoordBox& box, std::span<float> out) const {
  if (level == 0) {
    grids_->bone.gather_surface(box, out);
    return;
  }
  const CoordBox coarse = coarse_box(box, level);
  std::vector<float> samples(count(coarse));
  grids_->bone.gather_surface(coarse, samples);
  interpolate(coarse, samples, box, level, out);
}

void CutField::gather_solid(int level, const CoordBox& box, std::span<float> out) const {
  gather_surface(level, box, out);
  std::vector<float> cut(out.size());
  for (int from = 0; from < kLevels; ++from) {
    const SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(from)];
    const CoordBox there = from <= level ? coarse_box(box, level - from)
                                         : CoordBox{(1 << (from - level)) * box.min, (1 << (from - level)) * box.max};
    if (!any_cut(cuts, there)) continue;
    gather_at_level(cuts, from, level, box, cut);
    // R at its clip says only that no cut is near: there the depth is that of S.
    const float uncut = cuts.background();
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = cut[i] < uncut ? std::max(out[i], -cut[i]) : out[i];
  }
}

double CutField::solid_mm(const Vec3& point_mm) const {
  double f = grids_->bone.surface_mm(point_mm);
  for (int level = 0; level < kLevels; ++level) {
    const SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(level)];
    const double r = cuts.trilinear(point_mm / level_pitch_mm(grids_->bone.pitch_mm(), level));
    if (r < static_cast<double>(cuts.background())) f = std::max(f, -r);
  }
  return f;
}

double CutField::removed_mm3() const {
  // Every leaf of level 0 that any level cut into, at the finest level that did.
  std::set<Coord> touched;
  for (int level = 0; level < kLevels; ++level)
    for (const auto& origins : {grids_->cuts[static_cast<std::size_t>(level)].leaves(), grids_->cuts[static_cast<std::size_t>(level)].constants()})
      for (const Coord origin : origins) touched.insert(floor_to(shift_down(origin, level), kLeafSize));

  double removed = 0.0;
  std::vector<float> before, after;
  for (const Coord origin : touched) {
    int level = kLevels - 1;
    const auto box_at = [&](int l) {
      const std::int32_t n = kLeafSize << l;
      const Coord first{origin.x << l, origin.y << l, origin.z << l};
      return CoordBox{first, first + Coord{n - 1, n - 1, n - 1}};
    };
    while (level > 0 && !has_cuts(level, box_at(level))) --level;
    const CoordBox box = box_at(level);
    before.resize(count(box));
    after.resize(count(box));
    gather_surface(level, box, before);
    gather_solid(level, box, after);
    const double pitch = level_pitch_mm(grids_->bone.pitch_mm(), level);
    // A sample within half a pitch of a surface is bone in part.
    const auto bone_part = [&](float f) { return std::clamp(0.5 - static_cast<double>(f) / pitch, 0.0, 1.0); };
    double samples = 0.0;
    for (std::size_t i = 0; i < before.size(); ++i) samples += bone_part(before[i]) - bone_part(after[i]);
    removed += samples * pitch * pitch * pitch;
  }
  return removed;
}

}  // namespace osteon
