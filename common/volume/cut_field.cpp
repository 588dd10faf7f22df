#include "common/volume/cut_field.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/block_gather.hpp"
#include "common/volume/sparse_volume.hpp"

namespace osteon {

struct CutField::Grids {
  Case bone;
  BodyId body;
  std::shared_ptr<const ToolBox> tools;
  std::array<SparseVolume, kLevels> cuts;  // R of each level
};

namespace {

// The thread sanitizer does not see the library's own synchronisation.
#if defined(__SANITIZE_THREAD__)
constexpr bool kMayUseThreads = false;
#else
constexpr bool kMayUseThreads = true;
#endif

std::size_t count(const CoordBox& box) {
  const Coord d = box.dims();
  return static_cast<std::size_t>(d.x) * static_cast<std::size_t>(d.y) * static_cast<std::size_t>(d.z);
}

// Samples of level 0 around a box of samples of `level`.
CoordBox coarse_box(const CoordBox& box, int level) {
  return {shift_down(box.min, level), shift_down(box.max, level) + Coord{1, 1, 1}};
}

// Linear interpolation from a coarser lattice, one axis after the other: `fine` samples per coarse sample.
void interpolate(const CoordBox& coarse, std::span<const float> from, const CoordBox& box, int shift,
                 std::span<float> out, std::vector<float>& lines) {
  const std::int32_t fine = 1 << shift, mask = fine - 1;
  const float step = 1.0f / static_cast<float>(fine);
  const Coord cd = coarse.dims(), d = box.dims();
  const auto cy = static_cast<std::size_t>(cd.y), cz = static_cast<std::size_t>(cd.z);
  const auto ny = static_cast<std::size_t>(d.y), nz = static_cast<std::size_t>(d.z);
  // Along z on every line of the coarse lattice, then along y on two of its planes at a time.
  const std::size_t coarse_lines = static_cast<std::size_t>(cd.x) * cy, plane = ny * nz;
  lines.resize(coarse_lines * nz + 2 * plane);
  for (std::size_t line = 0; line < coarse_lines; ++line) {
    const float* p = from.data() + line * cz;
    float* along_z = lines.data() + line * nz;
    for (std::size_t i = 0; i < nz; ++i) {
      const std::int32_t z = box.min.z + static_cast<std::int32_t>(i);
      const float* q = p + ((z >> shift) - coarse.min.z);
      along_z[i] = q[0] + static_cast<float>(z & mask) * step * (q[1] - q[0]);
    }
  }
  const auto lerp = [nz](const float* a, const float* b, float weight, float* to) {
    for (std::size_t i = 0; i < nz; ++i) to[i] = a[i] + weight * (b[i] - a[i]);
  };
  const auto fill_plane = [&](std::int32_t x, float* to) {
    for (std::size_t j = 0; j < ny; ++j) {
      const std::int32_t y = box.min.y + static_cast<std::int32_t>(j);
      const std::size_t line =
          static_cast<std::size_t>(x - coarse.min.x) * cy + static_cast<std::size_t>((y >> shift) - coarse.min.y);
      const float* a = lines.data() + line * nz;
      lerp(a, a + nz, static_cast<float>(y & mask) * step, to + j * nz);
    }
  };
  float* near_plane = lines.data() + coarse_lines * nz;
  float* far_plane = near_plane + plane;
  std::int32_t at = (box.min.x >> shift) - 1;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x) {
    if ((x >> shift) != at) {
      const bool first = x == box.min.x;
      at = x >> shift;
      if (first)
        fill_plane(at, near_plane);
      else
        std::swap(near_plane, far_plane);
      fill_plane(at + 1, far_plane);
    }
    const float wx = static_cast<float>(x & mask) * step;
    float* to = out.data() + static_cast<std::size_t>(x - box.min.x) * plane;
    for (std::size_t j = 0; j < ny; ++j) lerp(near_plane + j * nz, far_plane + j * nz, wx, to + j * nz);
  }
}

// R of one level on the samples of another. Interpolated if the other is finer, every nth sample if it is coarser.
void gather_at_level(const SparseVolume& cuts, int from_level, int level, const CoordBox& box, std::span<float> out,
                     GatherScratch& scratch) {
  if (from_level >= level) {
    if (from_level == level)
      cuts.gather(box, out);
    else
      cuts.gather_every(1 << (from_level - level), box, out);
    return;
  }
  const int shift = level - from_level;
  const CoordBox coarse = coarse_box(box, shift);
  scratch.coarse.resize(count(coarse));
  cuts.gather(coarse, scratch.coarse);
  interpolate(coarse, scratch.coarse, box, shift, out, scratch.lines);
}

// R at its clip only says that no cut is near. There the depth is that of S.
void take_cut(std::span<const float> cuts, float uncut, std::span<float> out) {
  const float* cut = cuts.data();
  float* solid = out.data();
  const std::size_t samples = out.size();
  for (std::size_t i = 0; i < samples; ++i) {
    const float other = cut[i] < uncut ? -cut[i] : solid[i];
    solid[i] = solid[i] < other ? other : solid[i];
  }
}

std::int16_t to_quanta(float mm) { return static_cast<std::int16_t>(std::lround(mm * 1024.0f)); }

// A cut is applied to every body of a room, so the body that it names does not matter here.
SweptTool sweep(const CutField::Grids& grids, const Cut& cut) {
  const ToolBox::Entry* tool = grids.tools->find(cut.tool);
  OSTEON_CHECK(tool != nullptr && tool->body.cuts());
  return SweptTool(cut, tool->body, grids.bone.pitch_mm());
}

// Whether a leaf is stored depends only on the case and the leaf's position, never on earlier cuts: it is stored if any
// leaf of level 0 that it touches has bone. Neighbours touch the same few leaves, so the last results are cached.
class BoneNear {
 public:
  BoneNear(const Case& bone, int level) : bone_(bone), level_(level) {}

  bool operator()(Coord origin) {
    const CoordBox box = coarse_box({origin, origin + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1}}, level_);
    const Coord first = floor_to(box.min, kLeafSize);
    for (std::int32_t x = first.x; x <= box.max.x; x += kLeafSize)
      for (std::int32_t y = first.y; y <= box.max.y; y += kLeafSize)
        for (std::int32_t z = first.z; z <= box.max.z; z += kLeafSize)
          if (in_leaf({x, y, z})) return true;
    return false;
  }

 private:
  bool in_leaf(Coord leaf) {
    Answer& answer = answers_[CoordHash{}({leaf.x >> 3, leaf.y >> 3, leaf.z >> 3}) % answers_.size()];
    if (!answer.known || answer.leaf != leaf) answer = {leaf, true, bone_.has_bone({leaf, leaf})};
    return answer.bone;
  }

  struct Answer {
    Coord leaf;
    bool known = false, bone = false;
  };
  const Case& bone_;
  int level_;
  std::array<Answer, 64> answers_{};
};

// From this many evaluations of a sweep in a leaf on (about 1/3 microsecond each), several threads are worthwhile. The
// bytes do not depend on it, because every leaf is cut separately.
constexpr std::size_t kThreadedFrom = 192;
constexpr std::size_t kLeavesAtOnce = 16;

CutReport cut_leaves(CutField::Grids& grids, const SweptTool& swept, int level, const CutPlan& plan) {
  SparseVolume& cuts = grids.cuts[static_cast<std::size_t>(level)];
  CutReport report;
  report.level = level;
  report.visited = plan.visited * kLeafVoxels;

  std::vector<Coord> origins;
  origins.reserve(plan.leaves.size());
  for (const CutPlan::Leaf& leaf : plan.leaves) origins.push_back(leaf.origin);
  std::vector<SparseVolume::Place> places(origins.size());
  cuts.find(origins, places);

  struct Job {
    const CutPlan::Leaf* leaf;
    float* samples;  // of the volume; null for a missing leaf
    LeafChange change;
    SparseVolume::NewLeaf made;
  };
  std::vector<Job> jobs;
  jobs.reserve(origins.size());
  report.reached_leaves.reserve(origins.size());
  BoneNear bone_near(grids.bone, level);
  for (std::size_t i = 0; i < origins.size(); ++i) {
    const bool removed = !places[i].samples && places[i].constant != cuts.background();
    if (!places[i].samples && !removed && !bone_near(origins[i])) continue;
    report.reached_leaves.push_back(origins[i]);
    if (!removed) jobs.push_back({&plan.leaves[i], places[i].samples, {}, nullptr});
  }

  const float background = cuts.background();
  const auto work = [&](std::size_t first, std::size_t last) {
    alignas(64) std::array<float, kLeafVoxels> scratch;
    for (std::size_t i = first; i < last; ++i) {
      Job& job = jobs[i];
      if (job.samples) {
        job.change = swept.cut_leaf(plan, *job.leaf, std::span<float, kLeafVoxels>(job.samples, kLeafVoxels));
        continue;
      }
      scratch.fill(background);
      job.change = swept.cut_leaf(plan, *job.leaf, scratch);
      if (job.change.modified > 0 && !job.change.removed) job.made = SparseVolume::make_leaf(job.leaf->origin, scratch);
    }
  };
  if (plan.near.size() >= kThreadedFrom && kMayUseThreads) {
    // Isolated, because a thread that waits here must not take other work, which may be long.
    tbb::this_task_arena::isolate([&] {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, jobs.size(), kLeavesAtOnce),
                        [&](const tbb::blocked_range<std::size_t>& part) { work(part.begin(), part.end()); });
    });
  } else {
    work(0, jobs.size());
  }

  report.changed_leaves.reserve(jobs.size());
  for (Job& job : jobs) {
    if (job.change.computed) report.computed += kLeafVoxels;
    if (job.change.modified == 0) continue;
    report.modified += job.change.modified;
    report.changed_leaves.push_back(job.leaf->origin);
    if (job.change.removed)
      cuts.set_constant(job.leaf->origin, -background);
    else if (job.made)
      cuts.put(std::move(job.made));
  }
  return report;
}

}  // namespace

CutField::CutField(Case bone, BodyId body, std::shared_ptr<const ToolBox> tools) {
  const double h = bone.pitch_mm();
  grids_ = std::make_unique<Grids>(
      Grids{std::move(bone),
            body,
            std::move(tools),
            {SparseVolume(band_mm(level_pitch_mm(h, 0))), SparseVolume(band_mm(level_pitch_mm(h, 1))),
             SparseVolume(band_mm(level_pitch_mm(h, 2)))}});
}
CutField::~CutField() = default;
CutField::CutField(CutField&&) noexcept = default;
CutField& CutField::operator=(CutField&&) noexcept = default;

const Case& CutField::bone() const { return grids_->bone; }
BodyId CutField::body() const { return grids_->body; }
const std::shared_ptr<const ToolBox>& CutField::tools() const { return grids_->tools; }

CutReport CutField::apply(const Cut& cut) {
  const SweptTool swept = sweep(*grids_, cut);
  return cut_leaves(*grids_, swept, cut.level, swept.plan());
}

CutReport CutField::apply_to(const Cut& cut, std::span<const Coord> leaves) {
  const SweptTool swept = sweep(*grids_, cut);
  return cut_leaves(*grids_, swept, cut.level, swept.plan(leaves));
}

void CutField::reset(int level, Coord origin) {
  SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(level)];
  cuts.set_constant(origin, cuts.background());
}

std::vector<Coord> CutField::reach(const Cut& cut) const {
  std::vector<Coord> leaves = sweep(*grids_, cut).leaves();
  BoneNear bone_near(grids_->bone, cut.level);
  std::erase_if(leaves, [&](Coord origin) { return !bone_near(origin); });
  return leaves;
}

void CutField::restore(const FieldLeaf& leaf) {
  OSTEON_CHECK(leaf.level >= 0 && leaf.level < kLevels && leaf.holds_values());
  SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(leaf.level)];
  const std::int16_t removed = to_quanta(-cuts.background());
  if (std::ranges::all_of(leaf.values, [&](std::int16_t v) { return v == removed; })) {
    cuts.set_constant(leaf.origin, -cuts.background());
    return;
  }
  const auto mm = [](std::int16_t v) { return static_cast<float>(v) * static_cast<float>(kQuantum_mm); };
  if (leaf.is_constant()) {
    const float value = mm(leaf.values.front());
    // A leaf of one value is stored without samples only if it is wholly cut away or was never cut.
    if (value == cuts.background())
      cuts.set_constant(leaf.origin, value);
    else
      std::fill_n(cuts.edit_leaf(leaf.origin), kLeafVoxels, value);
    return;
  }
  std::ranges::transform(leaf.values, cuts.edit_leaf(leaf.origin), mm);
}

bool CutField::merge(const FieldLeaf& mask) {
  OSTEON_CHECK(mask.level >= 0 && mask.level < kLevels && mask.holds_values());
  FieldLeaf merged{mask.body, mask.level, mask.origin, {}};
  read(merged);
  bool changed = false;
  if (mask.is_constant() && merged.is_constant()) {
    changed = mask.values.front() < merged.values.front();
    merged.values.front() = std::min(merged.values.front(), mask.values.front());
  } else {
    merged.expand();
    for (std::size_t i = 0; i < kLeafVoxels; ++i) {
      changed |= mask.value(i) < merged.values[i];
      merged.values[i] = std::min(merged.values[i], mask.value(i));
    }
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
  const float* values = cuts.leaf(leaf.origin);
  if (!values) {
    leaf.values = std::vector<std::int16_t>{to_quanta(cuts.value(leaf.origin))};
    return;
  }
  leaf.values.resize(kLeafVoxels);
  std::ranges::transform(std::span(values, kLeafVoxels), leaf.values.begin(), to_quanta);
}

Digest CutField::hash() const { return field_hash(leaves(), grids_->bone.pitch_mm()); }

bool CutField::has_cuts(int level, const CoordBox& box) const {
  return grids_->cuts[static_cast<std::size_t>(level)].any_stored(box);
}

std::size_t CutField::memory_bytes() const {
  std::size_t bytes = 0;
  for (const SparseVolume& cuts : grids_->cuts) bytes += cuts.memory_bytes();
  return bytes;
}

void CutField::gather_cuts(int level, const CoordBox& box, std::span<float> out) const {
  grids_->cuts[static_cast<std::size_t>(level)].gather(box, out);
}

void CutField::gather_surface(int level, const CoordBox& box, std::span<float> out) const {
  GatherScratch scratch;
  gather_surface(level, box, out, scratch);
}

void CutField::gather_surface(int level, const CoordBox& box, std::span<float> out, GatherScratch& scratch) const {
  OSTEON_CHECK(out.size() == count(box));
  if (level == 0) {
    grids_->bone.gather_surface(box, out);
    return;
  }
  const CoordBox coarse = coarse_box(box, level);
  scratch.coarse.resize(count(coarse));
  grids_->bone.gather_surface(coarse, scratch.coarse);
  interpolate(coarse, scratch.coarse, box, level, out, scratch.lines);
}

void CutField::gather_solid(int level, const CoordBox& box, std::span<float> out) const {
  GatherScratch scratch;
  gather_solid(level, box, out, scratch);
}

void CutField::gather_solid(int level, const CoordBox& box, std::span<float> out, GatherScratch& scratch) const {
  gather_surface(level, box, out, scratch);
  take_cuts(level, box, out, scratch);
}

CutField::Gathered CutField::gather_block(int level, const CoordBox& box, std::span<float> solid,
                                          std::span<float> surface) const {
  OSTEON_CHECK(is_block(box) && solid.size() == kBlockVolume && surface.size() == kBlockVolume);
  static thread_local GatherScratch scratch;  // many blocks are made at a time, on any thread
  using Out = std::span<float, kBlockVolume>;
  std::array<LeafView, kBlockLeaves> leaves;  // of S at level 0, otherwise of R of the block's own level
  const CoordBox coarse = coarse_box(box, level);
  const bool any_surface = level == 0 ? grids_->bone.view_surface(box, leaves) : grids_->bone.has_surface(coarse);
  std::array<bool, kLevels> any_cut{};
  bool any = false;
  std::array<LeafView, kBlockLeaves> own;
  for (int from = 0; from < kLevels; ++from) {
    const SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(from)];
    const std::int32_t fine = 1 << std::max(0, from - level);
    const CoordBox there = from < level ? coarse_box(box, level - from) : CoordBox{fine * box.min, fine * box.max};
    bool& here = any_cut[static_cast<std::size_t>(from)];
    here = from == level ? cuts.view(box, own) : cuts.any_stored(there);
    any |= here;
  }
  if (!any_surface && !any) return Gathered::nothing;

  float* const uncut = any ? surface.data() : solid.data();
  if (level == 0) {
    copy_block(leaves, Out(uncut, kBlockVolume));
  } else {
    scratch.coarse.resize(count(coarse));
    grids_->bone.gather_surface(coarse, scratch.coarse);
    interpolate_block(scratch.coarse, level, Out(uncut, kBlockVolume));
  }
  if (!any) return Gathered::solid;

  bool first = true;
  for (int from = 0; from < kLevels; ++from) {
    if (!any_cut[static_cast<std::size_t>(from)]) continue;
    const SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(from)];
    if (from == level) {
      const std::span<const float, kBlockVolume> before(first ? surface.data() : solid.data(), kBlockVolume);
      cut_block(own, cuts.background(), before, Out(solid.data(), kBlockVolume));
    } else {
      if (first) std::ranges::copy(surface, solid.begin());
      scratch.cut.resize(kBlockVolume);
      if (from < level) {
        const CoordBox there = coarse_box(box, level - from);
        scratch.coarse.resize(count(there));
        cuts.gather(there, scratch.coarse);
        interpolate_block(scratch.coarse, level - from, Out(scratch.cut.data(), kBlockVolume));
      } else {
        cuts.gather_every(1 << (from - level), box, scratch.cut);
      }
      take_cut(scratch.cut, cuts.background(), solid);
    }
    first = false;
  }
  return Gathered::both;
}

void CutField::take_cuts(int level, const CoordBox& box, std::span<float> out, GatherScratch& scratch) const {
  for (int from = 0; from < kLevels; ++from) {
    const SparseVolume& cuts = grids_->cuts[static_cast<std::size_t>(from)];
    const CoordBox there = from <= level ? coarse_box(box, level - from)
                                         : CoordBox{(1 << (from - level)) * box.min, (1 << (from - level)) * box.max};
    if (!cuts.any_stored(there)) continue;
    scratch.cut.resize(out.size());
    gather_at_level(cuts, from, level, box, scratch.cut, scratch);
    take_cut(scratch.cut, cuts.background(), out);
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
  // Every cell of 8³ voxels of level 0 that any level cut into, at the finest level that did. A cell ends at the first
  // samples of the next cell. So cells before a cut leaf lose bone too.
  std::set<Coord> touched;
  for (int level = 0; level < kLevels; ++level)
    for (const auto& origins : {grids_->cuts[static_cast<std::size_t>(level)].leaves(),
                                grids_->cuts[static_cast<std::size_t>(level)].constants()})
      for (const Coord origin : origins)
        for (int before = 0; before < 8; ++before)
          touched.insert(
              floor_to(shift_down(origin - Coord{before & 1, before >> 1 & 1, before >> 2}, level), kLeafSize));

  double removed = 0.0;
  std::vector<float> before, after;
  GatherScratch scratch;
  for (const Coord origin : touched) {
    const auto box_at = [&](int l) {
      const std::int32_t n = kLeafSize << l;
      const Coord first{origin.x << l, origin.y << l, origin.z << l};
      return CoordBox{first, first + Coord{n, n, n}};
    };
    if (!grids_->bone.has_bone(box_at(0))) continue;
    int level = kLevels - 1;
    while (level > 0 && !has_cuts(level, box_at(level))) --level;
    const CoordBox box = box_at(level);
    before.resize(count(box));
    after.resize(count(box));
    gather_surface(level, box, before, scratch);
    gather_solid(level, box, after, scratch);
    const double pitch = level_pitch_mm(grids_->bone.pitch_mm(), level);
    // A sample within half a pitch of a surface is partly bone. Samples at both ends have half weight, so that cells of
    // different levels fill space without overlap.
    const auto bone_part = [&](float f) { return std::clamp(0.5 - static_cast<double>(f) / pitch, 0.0, 1.0); };
    const std::int32_t n = kLeafSize << level;
    const auto weight = [n](std::int32_t i) { return i == 0 || i == n ? 0.5 : 1.0; };
    double samples = 0.0;
    std::size_t i = 0;
    for (std::int32_t x = 0; x <= n; ++x)
      for (std::int32_t y = 0; y <= n; ++y) {
        double line = 0.0;
        for (std::int32_t z = 0; z <= n; ++z, ++i) line += weight(z) * (bone_part(before[i]) - bone_part(after[i]));
        samples += weight(x) * weight(y) * line;
      }
    removed += samples * pitch * pitch * pitch;
  }
  return removed;
}

}  // namespace osteon
