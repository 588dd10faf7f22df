#include "common/surface/surface_blocks.hpp"

#include <algorithm>
#include <set>

#include "common/core/check.hpp"

namespace osteon {
namespace {

constexpr int kFinest = kLevels - 1;
static_assert(kBlockCells == 1 << 4 && kFinest == 2 && kCoarsestLevel == -2);

Coord shift_up(Coord c, int shift) { return (1 << shift) * c; }
Coord at_shift(Coord c, int up) { return up >= 0 ? shift_up(c, up) : shift_down(c, -up); }

template <class Visit>
void for_each(const CoordBox& box, Visit visit) {
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) visit(Coord{x, y, z});
}

// Blocks of a level that read samples of a box of that level. Block b reads from 16 b − reach to 16 b + 16 + reach.
CoordBox readers(const CoordBox& samples, std::int32_t reach) {
  const Coord below{reach + 1, reach + 1, reach + 1}, above{reach, reach, reach};
  return {shift_down(samples.min - below, 4), shift_down(samples.max + above, 4)};
}

// The box of samples of `to` that covers a box of samples of `from`.
CoordBox at_level(const CoordBox& box, int from, int to) {
  if (to <= from) return {shift_down(box.min, from - to), shift_down(box.max, from - to) + Coord{1, 1, 1}};
  const std::int32_t fine = 1 << (to - from);
  return {fine * box.min - Coord{fine, fine, fine}, fine * box.max + Coord{fine, fine, fine}};
}

double distance_mm(const Box& box, const Vec3& point) {
  return (point - point.cwiseMax(box.min_mm).cwiseMin(box.max_mm)).norm();
}

}  // namespace

int SurfaceBlocks::base_level(Coord block) const {
  for (int level = kCoarsestLevel; level < 0; ++level) {
    const Indices& drawn = coarse_[static_cast<std::size_t>(-1 - level)];
    if (!drawn.empty() && drawn.contains(shift_down(block, -level))) return level;
  }
  return 0;
}

int SurfaceBlocks::level_at(Coord finest) const {
  if (const int base = base_level(shift_down(finest, kFinest)); base < 0) return base;
  for (int level = kFinest; level > 0; --level)
    if (cut_at(level, shift_down(finest, kFinest - level))) return level;
  return 0;
}

bool SurfaceBlocks::drawn(const BlockKey& key) const {
  if (key.level < 0) return coarse_at(key.level, key.index);
  return base_level(shift_down(key.index, key.level)) == 0 && (key.level == 0 || cut_at(key.level, key.index));
}

CoveredGroups SurfaceBlocks::covered(const BlockKey& key) const {
  if (!drawn(key)) return kWhollyCovered;
  CoveredGroups groups = 0;
  if (key.level < 0) return groups;
  for (int finer = key.level + 1; finer < kLevels; ++finer) {
    if (fine_[static_cast<std::size_t>(finer - 1)].empty()) continue;
    // A block one level finer covers 2³ groups of 4³ cells. A block two levels finer covers one group.
    const int shift = finer - key.level;
    const std::int32_t blocks = 1 << shift, wide = 4 / blocks;
    const Coord first = shift_up(key.index, shift);
    for_each({{0, 0, 0}, {blocks - 1, blocks - 1, blocks - 1}}, [&](Coord at) {
      if (!cut_at(finer, first + at)) return;
      for_each({wide * at, wide * at + Coord{wide - 1, wide - 1, wide - 1}},
               [&](Coord g) { groups |= CoveredGroups{1} << ((g.x * 4 + g.y) * 4 + g.z); });
    });
  }
  return groups;
}

Seams SurfaceBlocks::seams(const BlockKey& key) const {
  Seams seams;
  const bool no_coarse = std::ranges::all_of(coarse_, [](const Indices& drawn) { return drawn.empty(); });
  if (key.level == kCoarsestLevel || (key.level <= 0 && no_coarse)) return seams;
  // At the finest level both halves of a neighbour are in one block.
  const int wide = key.level == kFinest ? 2 : 1;
  const auto around = [&](int i) { return wide == 2 ? (i == 0 ? -1 : i == 3 ? 1 : 0) : i - 1; };
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y)
      for (int z = 0; z < 4; ++z) {
        if ((x == 1 || x == 2) && (y == 1 || y == 2) && (z == 1 || z == 2)) continue;
        std::uint8_t& steps = seams.coarser[static_cast<std::size_t>((x * 4 + y) * 4 + z)];
        if (wide == 2 && (x == 2 || y == 2 || z == 2)) {
          const auto other = [](int i) { return i == 2 ? 1 : i; };
          steps = seams.coarser[static_cast<std::size_t>((other(x) * 4 + other(y)) * 4 + other(z))];
          continue;
        }
        const Coord offset{around(x), around(y), around(z)};
        const Coord finest = wide == 2 ? key.index + offset : at_shift(2 * key.index + offset, kFinest - 1 - key.level);
        steps = static_cast<std::uint8_t>(std::max(0, key.level - level_at(finest)));
      }
  return seams;
}

// Whether seams(key).most() is at least `steps`.
bool SurfaceBlocks::meets(const BlockKey& key, int steps) const {
  const bool no_coarse = std::ranges::all_of(coarse_, [](const Indices& drawn) { return drawn.empty(); });
  if (key.level - steps < kCoarsestLevel || (key.level - steps < 0 && no_coarse)) return false;
  const std::int32_t wide =
      key.level == kFinest ? 1 : 2;  // half blocks along a block; at the finest level only whole ones
  bool found = false;
  for_each({{-1, -1, -1}, {wide, wide, wide}}, [&](Coord at) {
    const auto inside = [wide](std::int32_t i) { return i >= 0 && i < wide; };
    if (found || (inside(at.x) && inside(at.y) && inside(at.z))) return;
    const Coord finest = wide == 1 ? key.index + at : at_shift(2 * key.index + at, kFinest - 1 - key.level);
    found = key.level - level_at(finest) >= steps;
  });
  return found;
}

namespace {

// The distinct blocks that read any of a cut's leaves. These leaves are close together, so they are marked in a box.
class Readers {
 public:
  // Blocks of level `to` that read samples of these leaves of level `from`, up to `reach` samples beyond their cells.
  void find(const std::vector<Coord>& leaves, int from, int to, std::int32_t reach, std::vector<Coord>& found) {
    found.clear();
    boxes_.clear();
    CoordBox all;
    for (const Coord origin : leaves) {
      const CoordBox box =
          readers(at_level({origin, origin + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1}}, from, to), reach);
      if (!boxes_.empty() && boxes_.back() == box) continue;
      boxes_.push_back(box);
      if (all.empty()) all = box;
      all = {{std::min(all.min.x, box.min.x), std::min(all.min.y, box.min.y), std::min(all.min.z, box.min.z)},
             {std::max(all.max.x, box.max.x), std::max(all.max.y, box.max.y), std::max(all.max.z, box.max.z)}};
    }
    if (boxes_.empty()) return;
    const Coord d = all.dims();
    if (std::int64_t{d.x} * d.y > kMostMarks / d.z) {
      for (const CoordBox& box : boxes_) for_each(box, [&](Coord index) { found.push_back(index); });
      std::ranges::sort(found);
      found.erase(std::unique(found.begin(), found.end()), found.end());
      return;
    }
    marks_.assign(static_cast<std::size_t>(d.x * d.y * d.z), 0);
    for (const CoordBox& box : boxes_)
      for_each({box.min - all.min, box.max - all.min},
               [&](Coord at) { marks_[static_cast<std::size_t>((at.x * d.y + at.y) * d.z + at.z)] = 1; });
    std::size_t i = 0;
    for_each(all, [&](Coord index) {
      if (marks_[i++] != 0) found.push_back(index);
    });
  }

 private:
  static constexpr std::int64_t kMostMarks = 1 << 15;
  std::vector<CoordBox> boxes_;
  std::vector<std::uint8_t> marks_;
};

}  // namespace

std::vector<BlockKey> SurfaceBlocks::touch(int level, const std::vector<Coord>& changed_leaves) {
  std::vector<BlockKey> stale;
  if (changed_leaves.empty()) return stale;
  Readers readers_of;
  std::vector<Coord> fresh, near, far;
  const bool any_coarse = std::ranges::any_of(coarse_, [](const Indices& drawn) { return !drawn.empty(); });
  if (level > 0) {
    readers_of.find(changed_leaves, level, level, 1, near);
    for (const Coord index : near)
      if (fine_[static_cast<std::size_t>(level - 1)].insert(index).second) fresh.push_back(index);
  }

  for (int l = any_coarse ? kCoarsestLevel : 0; l < kLevels; ++l) {
    if (l > 0 && fine_[static_cast<std::size_t>(l - 1)].empty()) continue;  // nothing is drawn at this level
    readers_of.find(changed_leaves, level, l, 1, near);
    for (const Coord index : near)
      if (const BlockKey key{body_, l, index}; drawn(key)) stale.push_back(key);
    // The normals on a seam use samples of the coarser level, which extend farther: 2, 4, … samples.
    const int most_steps = any_coarse ? l - kCoarsestLevel : l;
    for (int steps = 1; steps <= most_steps; ++steps) {
      readers_of.find(changed_leaves, level, l, 1 << steps, far);
      for (const Coord index : far) {
        const BlockKey key{body_, l, index};
        if (!std::ranges::binary_search(near, index) && drawn(key) && meets(key, steps)) stale.push_back(key);
      }
    }
  }

  // When a block is drawn for the first time, coarser blocks give up its cells, and other blocks change their seams.
  for (const Coord index : fresh) {
    for (int l = 0; l < level; ++l)
      if (const BlockKey key{body_, l, shift_down(index, level - l)}; drawn(key)) stale.push_back(key);
    for (int l = 1; l < kLevels; ++l) {
      const std::int32_t wide = l > level ? 1 << (l - level) : 1;
      const Coord first = at_shift(index, l - level);
      for_each({first - Coord{1, 1, 1}, first + Coord{wide, wide, wide}}, [&](Coord at) {
        if (const BlockKey key{body_, l, at}; drawn(key)) stale.push_back(key);
      });
    }
  }
  std::ranges::sort(stale);
  stale.erase(std::unique(stale.begin(), stale.end()), stale.end());
  return stale;
}

std::vector<BlockKey> SurfaceBlocks::focus(std::span<const Focus> focuses, const CoordBox& bone_samples,
                                           double pitch_mm) {
  std::set<BlockKey> stale;
  if (bone_samples.empty()) return {};
  const auto near = [&](int level, Coord index, double Focus::*limit, bool is_finer) {
    if (focuses.empty()) return true;
    const double edge_mm = kBlockCells * level_pitch_mm(pitch_mm, level);
    const Vec3 first_mm(index.x * edge_mm, index.y * edge_mm, index.z * edge_mm);
    const Box box{first_mm, first_mm.array() + edge_mm};
    return std::ranges::any_of(focuses, [&](const Focus& f) {
      return distance_mm(box, f.position_mm) <= f.*limit * (is_finer ? kFocusHysteresis : 1.0);
    });
  };
  // Cells extend one sample beyond the block, so a surface may be in the block below the first sample.
  const auto blocks_of_bone = [&](int level) {
    return CoordBox{shift_down(bone_samples.min - Coord{1, 1, 1}, 4 - level), shift_down(bone_samples.max, 4 - level)};
  };
  Indices& halves = coarse_[0];
  Indices& quarters = coarse_[1];
  // Cut blocks are drawn in full, and so is the neighbouring block of level 0.
  Indices in_full;  // blocks of level -1
  for (int level = 1; level < kLevels; ++level)
    for (const Coord index : fine_[static_cast<std::size_t>(level - 1)]) {
      const Coord block = shift_down(index, level);
      for_each({shift_down(block - Coord{1, 1, 1}, 1), shift_down(block + Coord{1, 1, 1}, 1)},
               [&](Coord c) { in_full.insert(c); });
    }
  const CoordBox roots = blocks_of_bone(kCoarsestLevel);
  for_each(CoordBox{2 * roots.min, 2 * roots.max + Coord{1, 1, 1}}, [&](Coord child) {
    const bool was_full = !halves.contains(child) && !quarters.contains(shift_down(child, 1));
    if (near(-1, child, &Focus::full_mm, was_full)) in_full.insert(child);
  });
  std::set<Coord> changed;  // blocks of level -1 whose level changed
  for_each(roots, [&](Coord root) {
    const bool was_quarter = quarters.contains(root);
    // Neighbouring levels differ by at most one step. Where a coarse contour met one four times finer, the surface
    // could fold.
    bool quarter = !near(kCoarsestLevel, root, &Focus::half_mm, !was_quarter);
    for_each({2 * root - Coord{1, 1, 1}, 2 * root + Coord{2, 2, 2}},
             [&](Coord c) { quarter = quarter && !in_full.contains(c); });
    for_each({2 * root, 2 * root + Coord{1, 1, 1}}, [&](Coord child) {
      const bool was_half = halves.contains(child);
      const bool half = !quarter && !in_full.contains(child);
      if (quarter != was_quarter || half != was_half) changed.insert(child);
      if (half)
        halves.insert(child);
      else
        halves.erase(child);
    });
    if (quarter)
      quarters.insert(root);
    else
      quarters.erase(root);
  });
  if (changed.empty()) return {};

  // All blocks in the changed region, and those beside it whose seams changed.
  std::set<Coord> around;
  for (const Coord at : changed)
    for_each({at - Coord{1, 1, 1}, at + Coord{1, 1, 1}}, [&](Coord c) { around.insert(c); });
  const CoordBox full = blocks_of_bone(0), half = blocks_of_bone(-1);
  for (const Coord at : around) {
    const bool inside = changed.contains(at);
    if (inside) stale.insert({body_, kCoarsestLevel, shift_down(at, 1)});
    if (half.contains(at) && (inside || drawn({body_, -1, at}))) stale.insert({body_, -1, at});
    for_each({2 * at, 2 * at + Coord{1, 1, 1}}, [&](Coord block) {
      if (full.contains(block) && (inside || drawn({body_, 0, block}))) stale.insert({body_, 0, block});
    });
  }
  for (int level = 1; level < kLevels; ++level)
    for (const Coord index : fine_[static_cast<std::size_t>(level - 1)])
      if (around.contains(shift_down(index, level + 1))) stale.insert({body_, level, index});
  return {stale.begin(), stale.end()};
}

std::vector<BlockKey> SurfaceBlocks::fine_blocks() const {
  std::vector<BlockKey> keys;
  for (int level = 1; level < kLevels; ++level)
    for (const Coord index : fine_[static_cast<std::size_t>(level - 1)]) keys.push_back({body_, level, index});
  std::ranges::sort(keys);
  return keys;
}

std::vector<BlockKey> SurfaceBlocks::coarse_blocks() const {
  std::vector<BlockKey> keys;
  for (int level = kCoarsestLevel; level < 0; ++level)
    for (const Coord index : coarse_[static_cast<std::size_t>(-1 - level)]) keys.push_back({body_, level, index});
  std::ranges::sort(keys);
  return keys;
}

}  // namespace osteon
