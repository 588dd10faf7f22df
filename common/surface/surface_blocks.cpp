#include "common/surface/surface_blocks.hpp"

#include <algorithm>

namespace osteon {
namespace {

std::int32_t floor_div(std::int32_t a, std::int32_t b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

// Blocks of a level whose samples, apron included, meet a box of that level's samples.
CoordBox blocks_around(const CoordBox& samples) {
  // Block b has the samples from 16 b − 1 to 16 b + 17.
  const auto first = [](std::int32_t lowest) { return floor_div(lowest - 2, kBlockCells); };
  const auto last = [](std::int32_t highest) { return floor_div(highest + 1, kBlockCells); };
  return {{first(samples.min.x), first(samples.min.y), first(samples.min.z)},
          {last(samples.max.x), last(samples.max.y), last(samples.max.z)}};
}

// The box of samples of `to` that covers a box of samples of `from`.
CoordBox at_level(const CoordBox& box, int from, int to) {
  if (to <= from) return {shift_down(box.min, from - to), shift_down(box.max, from - to) + Coord{1, 1, 1}};
  const std::int32_t fine = 1 << (to - from);
  return {fine * box.min - Coord{fine, fine, fine}, fine * box.max + Coord{fine, fine, fine}};
}

}  // namespace

std::vector<BlockKey> SurfaceBlocks::touch(int level, const std::vector<Coord>& changed_leaves) {
  std::set<BlockKey> stale;
  for (const Coord origin : changed_leaves) {
    const CoordBox leaf{origin, origin + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1}};
    for (int l = 0; l < kLevels; ++l) {
      const CoordBox blocks = blocks_around(at_level(leaf, level, l));
      for (std::int32_t x = blocks.min.x; x <= blocks.max.x; ++x)
        for (std::int32_t y = blocks.min.y; y <= blocks.max.y; ++y)
          for (std::int32_t z = blocks.min.z; z <= blocks.max.z; ++z) {
            const BlockKey key{body_, l, {x, y, z}};
            // At the cut's own level a block is drawn from now on. The coarser blocks from which it takes its cells have
            // samples in this leaf as well, so they are named by the same rule: drawn, and its samples changed.
            if (l == level && l > 0) fine_.insert(key);
            if (l == 0 || fine_.contains(key)) stale.insert(key);
          }
    }
  }
  return {stale.begin(), stale.end()};
}

CoveredGroups SurfaceBlocks::covered(const BlockKey& key) const {
  CoveredGroups groups = 0;
  for (int i = 0; i < 64; ++i) {
    const Coord group = 4 * key.index + Coord{i >> 4, i >> 2 & 3, i & 3};
    for (int finer = key.level + 1; finer < kLevels; ++finer) {
      // A group of 4 cells of this level is 4 · 2^(finer − level) cells of the finer one: half a block or a whole.
      const Coord index = finer == key.level + 1 ? shift_down(group, 1) : group;
      if (fine_.contains({body_, finer, index})) groups |= CoveredGroups{1} << i;
    }
  }
  return groups;
}

}  // namespace osteon
