#include "common/volume/fragment_masks.hpp"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <utility>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/solid_labels.hpp"

// The masks. Let M be −band on the piece's samples and +band on the samples of the rest. On air beside the piece it
// is −band, beside the rest +band, beside both 0. The parent takes R = min(R, M), the piece R = min(R, −M).
// Trilinear M is negative around the piece and positive around the rest. So the parent keeps the points with M > 0,
// the piece those with M < 0, and no point is in both. Where piece and rest are within a cell of each other, M is
// written on one lattice: that of the finest cut there. Farther away only one of them is near, and whole leaves of
// level 0 are constants. The constants extend one sample over the seam, so that both lattices cover it.
namespace osteon {
namespace {

constexpr std::uint8_t kPiece = 1, kRest = 2, kUnknown = 4;  // of a solid sample; air is 0

std::int16_t band_of(const Case& bone, int level) {
  return static_cast<std::int16_t>(band_quanta(level_pitch_mm(bone.pitch_mm(), level)));
}

// Samples of a cell at the level of the masks, n along each axis.
struct Sides {
  std::int32_t n = 0;
  std::vector<std::uint8_t> side;
  [[nodiscard]] std::size_t index(Coord c) const { return to_index((c.x * n + c.y) * n + c.z); }
  [[nodiscard]] bool contains(Coord c) const {
    return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x < n && c.y < n && c.z < n;
  }
};

constexpr Coord kSix[6] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};

// Solid samples of unknown side take the side of a sample that they touch.
void flood(Sides& sides, std::vector<Coord> from) {
  while (!from.empty()) {
    const Coord c = from.back();
    from.pop_back();
    const std::uint8_t side = sides.side[sides.index(c)];
    for (const Coord step : kSix) {
      const Coord to = c + step;
      if (!sides.contains(to) || sides.side[sides.index(to)] != kUnknown) continue;
      sides.side[sides.index(to)] = side;
      from.push_back(to);
    }
  }
}

// Labels of a cell at its own level, as the finder assigned them.
std::vector<std::uint16_t> own_labels(const CutField& field, const PieceCell& cell) {
  const std::int32_t n = kLeafSize << cell.level;
  std::vector<std::uint16_t> labels(to_index(n * n * n), 1);
  if (cell.full) return labels;
  std::vector<float> f(labels.size());
  field.gather_solid(cell.level, cell_box(cell.origin, cell.level), f);
  const int count = label_solid({n, n, n}, f, labels);
  OSTEON_CHECK(to_index(count) == cell.in_piece.size());
  return labels;
}

// The sides of a cell's samples at `level`, which is not below its own. A fine sample of a coarser cell has the side of
// the coarse sample to which it is connected.
Sides sides_of(const CutField& field, const PieceCell& cell, int level) {
  OSTEON_CHECK(cell.level <= level);
  Sides sides{kLeafSize << level, {}};
  const std::vector<std::uint16_t> labels = own_labels(field, cell);
  const auto side_of = [&](std::uint16_t label) { return cell.in_piece[label - 1u] ? kPiece : kRest; };
  sides.side.assign(to_index(sides.n * sides.n * sides.n), 0);
  if (cell.level == level) {
    for (std::size_t i = 0; i < labels.size(); ++i)
      if (labels[i]) sides.side[i] = side_of(labels[i]);
    return sides;
  }
  std::vector<float> f(sides.side.size());
  field.gather_solid(level, cell_box(cell.origin, level), f);
  for (std::size_t i = 0; i < f.size(); ++i)
    if (f[i] < 0.0f) sides.side[i] = kUnknown;
  const int shift = level - cell.level;
  const std::int32_t n = kLeafSize << cell.level;
  std::vector<Coord> from;
  std::size_t i = 0;
  for (std::int32_t x = 0; x < n; ++x)
    for (std::int32_t y = 0; y < n; ++y)
      for (std::int32_t z = 0; z < n; ++z, ++i) {
        if (!labels[i]) continue;
        const Coord c{x << shift, y << shift, z << shift};
        sides.side[sides.index(c)] = side_of(labels[i]);
        from.push_back(c);
      }
  flood(sides, std::move(from));
  return sides;
}

using SidesOf = std::unordered_map<Coord, Sides, CoordHash>;

// Samples that a cell cannot decide by itself take the side of their neighbours. The remaining ones belong to the rest.
void settle_unknown(SidesOf& all) {
  for (int round = 0; round < 2; ++round)
    for (auto& [origin, sides] : all) {
      if (std::ranges::find(sides.side, kUnknown) == sides.side.end()) continue;
      std::vector<Coord> from;
      for (std::int32_t x = 0; x < sides.n; ++x)
        for (std::int32_t y = 0; y < sides.n; ++y)
          for (std::int32_t z = 0; z < sides.n; ++z) {
            if (sides.side[sides.index({x, y, z})] != kUnknown) continue;
            for (const Coord step : kSix) {
              Coord c = Coord{x, y, z} + step;
              if (sides.contains(c)) continue;
              const auto next = all.find(origin + kLeafSize * step);
              if (next == all.end()) continue;
              c = c - sides.n * step;
              const std::uint8_t side = next->second.side[next->second.index(c)];
              if (side != kPiece && side != kRest) continue;
              sides.side[sides.index({x, y, z})] = side;
              from.push_back({x, y, z});
              break;
            }
          }
      flood(sides, std::move(from));
    }
  for (auto& [origin, sides] : all) std::ranges::replace(sides.side, kUnknown, kRest);
}

// A cell's sides with a margin of one sample, from the neighbours that exist.
Sides with_margin(const SidesOf& all, Coord origin) {
  const std::int32_t n = all.at(origin).n;
  Sides grown{n + 2, {}};
  grown.side.assign(to_index(grown.n * grown.n * grown.n), 0);
  for (std::int32_t dx = -1; dx <= 1; ++dx)
    for (std::int32_t dy = -1; dy <= 1; ++dy)
      for (std::int32_t dz = -1; dz <= 1; ++dz) {
        const auto cell = all.find(origin + kLeafSize * Coord{dx, dy, dz});
        if (cell == all.end()) continue;
        const auto range = [&](std::int32_t d) { return std::pair(d < 0 ? n - 1 : 0, d > 0 ? 1 : n); };
        const auto [x0, x1] = range(dx);
        const auto [y0, y1] = range(dy);
        const auto [z0, z1] = range(dz);
        for (std::int32_t x = x0; x < x1; ++x)
          for (std::int32_t y = y0; y < y1; ++y)
            for (std::int32_t z = z0; z < z1; ++z)
              grown.side[grown.index(Coord{x, y, z} + Coord{1, 1, 1} + n * Coord{dx, dy, dz})] =
                  cell->second.side[cell->second.index({x, y, z})];
      }
  return grown;
}

// For each sample: what the 27 samples around it contain, one axis at a time.
std::vector<std::uint8_t> near_sides(const Sides& sides) {
  std::vector<std::uint8_t> now = sides.side, next(now.size());
  const std::size_t strides[3] = {to_index(sides.n * sides.n), to_index(sides.n), 1};
  for (const std::size_t stride : strides) {
    for (std::size_t i = 0; i < now.size(); ++i) {
      std::uint8_t seen = now[i];
      // At the border of the box, neighbours wrap around. Only the margin reads these.
      if (i >= stride) seen |= now[i - stride];
      if (i + stride < now.size()) seen |= now[i + stride];
      next[i] = seen;
    }
    std::swap(now, next);
  }
  return now;
}

void add_leaves(BodyId body, int level, Coord cell, const std::vector<std::int16_t>& values, std::int16_t band,
                std::vector<FieldLeaf>& out) {
  const std::int32_t n = kLeafSize << level;
  for (std::int32_t lx = 0; lx < n; lx += kLeafSize)
    for (std::int32_t ly = 0; ly < n; ly += kLeafSize)
      for (std::int32_t lz = 0; lz < n; lz += kLeafSize) {
        FieldLeaf leaf{body, level, (1 << level) * cell + Coord{lx, ly, lz}, std::vector<std::int16_t>(kLeafVoxels)};
        bool cuts = false;
        for (std::int32_t x = 0; x < kLeafSize; ++x)
          for (std::int32_t y = 0; y < kLeafSize; ++y)
            for (std::int32_t z = 0; z < kLeafSize; ++z) {
              const std::int16_t v = values[to_index(((lx + x) * n + ly + y) * n + lz + z)];
              leaf.values[to_index(x * 64 + y * 8 + z)] = v;
              cuts |= v != band;
            }
        if (!cuts) continue;
        leaf.compact();
        out.push_back(std::move(leaf));
      }
}

// Writes M of one cell where piece and rest are near each other into both masks.
void add_interface(const CutField& field, const SidesOf& all, int level, Coord origin, Fragment& fragment) {
  const Sides grown = with_margin(all, origin);
  const std::vector<std::uint8_t> near = near_sides(grown);
  const std::int32_t n = grown.n - 2;
  const std::int16_t band = band_of(field.bone(), level), none = static_cast<std::int16_t>(-band);
  std::vector<std::int16_t> taken(to_index(n * n * n), band), left(taken.size(), band);
  std::size_t i = 0;
  for (std::int32_t x = 0; x < n; ++x)
    for (std::int32_t y = 0; y < n; ++y)
      for (std::int32_t z = 0; z < n; ++z, ++i) {
        const std::size_t g = grown.index({x + 1, y + 1, z + 1});
        const std::uint8_t side = grown.side[g] ? grown.side[g] : near[g];
        if (side == (kPiece | kRest)) taken[i] = left[i] = 0;
        if (side == kPiece) taken[i] = none;
        // Air beside neither side: slivers thinner than the lattice may end there. They stay with the parent.
        if (side == kRest || side == 0) left[i] = none;
      }
  add_leaves(field.body(), level, origin, taken, band, fragment.taken);
  add_leaves(field.body(), level, origin, left, band, fragment.left);
}

// Constants on whole cells of level 0 without the other side nearby, and on the one layer of samples around them. At
// the seam both lattices cover what is solid.
void add_constants(const CutField& field, const CellMap& map, std::span<const PieceCell> cells,
                   std::span<const std::uint8_t> whole, std::vector<FieldLeaf>& out) {
  const std::int16_t band = band_of(field.bone(), 0), none = static_cast<std::int16_t>(-band);
  std::map<Coord, std::vector<std::int16_t>> beyond;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!whole[i]) continue;
    out.push_back({field.body(), 0, cells[i].origin, {none}});
    for (int around = 0; around < 27; ++around) {
      const Coord step{around / 9 - 1, around / 3 % 3 - 1, around % 3 - 1};
      const Coord next = cells[i].origin + kLeafSize * step;
      const std::int32_t place = map.find(next);
      if (place < 0 || whole[to_index(place)]) continue;
      auto& values = beyond.try_emplace(next, std::vector<std::int16_t>(kLeafVoxels, band)).first->second;
      const auto first = [](std::int32_t d) { return d < 0 ? kLeafSize - 1 : 0; };
      const auto end = [](std::int32_t d) { return d > 0 ? 1 : kLeafSize; };
      for (std::int32_t x = first(step.x); x < end(step.x); ++x)
        for (std::int32_t y = first(step.y); y < end(step.y); ++y)
          for (std::int32_t z = first(step.z); z < end(step.z); ++z) values[to_index(x * 64 + y * 8 + z)] = none;
    }
  }
  for (auto& [origin, values] : beyond) out.push_back({field.body(), 0, origin, std::move(values)});
}

void lower(FieldLeaf& leaf, const FieldLeaf& by) {
  if (!by.is_constant()) leaf.expand();
  for (std::size_t i = 0; i < leaf.values.size(); ++i) leaf.values[i] = std::min(leaf.values[i], by.value(i));
  leaf.compact();
}

// If the seam of a constant lies in a cell that has leaves of the same level, the two become one leaf.
void sort_and_unite(std::vector<FieldLeaf>& leaves) {
  std::ranges::sort(leaves, {}, [](const FieldLeaf& leaf) { return std::pair(leaf.level, leaf.origin); });
  std::size_t last = 0;
  for (std::size_t i = 1; i < leaves.size(); ++i) {
    if (leaves[i].level == leaves[last].level && leaves[i].origin == leaves[last].origin) {
      lower(leaves[last], leaves[i]);
    } else if (++last != i) {
      leaves[last] = std::move(leaves[i]);
    }
  }
  leaves.resize(std::min(leaves.size(), last + 1));
}

// The volume of a piece, cell by cell. A cell's samples and those of the planes after it, each end with half its
// weight, cover the cell exactly. So cells of different levels do not overlap. A sample within half a pitch of a
// surface is partly bone. The part in air is shared by the solid samples beside it.
class Measure {
 public:
  Measure(const CutField& field, const CellMap& map, std::span<const PieceCell> cells)
      : field_(field), map_(map), cells_(cells) {}

  void add(const PieceCell& cell, Fragment& fragment) {
    const double pitch = level_pitch_mm(field_.bone().pitch_mm(), cell.level);
    const CoordBox own = cell_box(cell.origin, cell.level);
    const CoordBox box{own.min - Coord{1, 1, 1}, own.max + Coord{2, 2, 2}};
    const std::int32_t n = own.dims().x, m = box.dims().x;
    std::vector<float> f(to_index(m * m * m));
    field_.gather_solid(cell.level, box, f);
    const auto value = [&](Coord c) {
      return f[to_index(((c.x - box.min.x) * m + c.y - box.min.y) * m + c.z - box.min.z)];
    };
    double samples = 0.0;
    for (std::int32_t x = 0; x <= n; ++x)
      for (std::int32_t y = 0; y <= n; ++y)
        for (std::int32_t z = 0; z <= n; ++z) {
          const Coord c = own.min + Coord{x, y, z};
          const double part = std::clamp(0.5 - static_cast<double>(value(c)) / pitch, 0.0, 1.0);
          if (part <= 0.0) continue;
          const auto end = [n](std::int32_t i) { return i == 0 || i == n ? 0.5 : 1.0; };
          const double weight = end(x) * end(y) * end(z);
          if (value(c) < 0.0f) {
            if (!in_piece(c, cell.level)) continue;
            samples += weight * part;
            if (own.contains(c)) fragment.bounds.include(position_mm(c, pitch));
            continue;
          }
          int solid = 0, ours = 0;
          for (const Coord step : kSix) {
            if (!(value(c + step) < 0.0f)) continue;
            ++solid;
            ours += in_piece(c + step, cell.level) ? 1 : 0;
          }
          if (ours > 0) samples += weight * part * ours / solid;
        }
    fragment.volume_mm3 += samples * pitch * pitch * pitch;
  }

 private:
  bool in_piece(Coord sample, int level) {
    const std::int32_t i = map_.find(floor_to(shift_down(sample, level), kLeafSize));
    if (i < 0 || !cells_[to_index(i)].has_piece) return false;
    const PieceCell& cell = cells_[to_index(i)];
    if (!cell.has_rest && cell.full) return true;
    auto found = labels_.find(i);
    if (found == labels_.end()) found = labels_.emplace(i, own_labels(field_, cell)).first;
    const std::int32_t n = kLeafSize << cell.level;
    const Coord there =
        cell.level >= level ? (1 << (cell.level - level)) * sample : shift_down(sample, level - cell.level);
    const Coord c = there - (1 << cell.level) * cell.origin;
    const std::uint16_t label = found->second[to_index((c.x * n + c.y) * n + c.z)];
    return label && cell.in_piece[label - 1u];
  }

  const CutField& field_;
  const CellMap& map_;
  std::span<const PieceCell> cells_;
  std::unordered_map<std::int32_t, std::vector<std::uint16_t>> labels_;
};

// The cell and all its neighbours are full, so no samples need to be read.
bool is_deep(const CellMap& map, std::span<const PieceCell> cells, const PieceCell& cell) {
  if (!cell.full) return false;
  for (int around = 0; around < 27; ++around) {
    const std::int32_t next =
        map.find(cell.origin + kLeafSize * Coord{around / 9 - 1, around / 3 % 3 - 1, around % 3 - 1});
    if (next < 0 || !cells[to_index(next)].full) return false;
  }
  return true;
}

}  // namespace

CellMap::CellMap(const CoordBox& bounds_samples, const std::vector<Coord>& origins) : count_(origins.size()) {
  // One extra cell on all sides, so that neighbours need no check.
  box_ = CoordBox{shift_down(bounds_samples.min, 3), shift_down(bounds_samples.max, 3)}.grown(1);
  const Coord d = box_.dims();
  cells_.assign(to_index(d.x) * to_index(d.y) * to_index(d.z), -1);
  for (std::size_t i = 0; i < origins.size(); ++i)
    cells_[index(shift_down(origins[i], 3))] = static_cast<std::int32_t>(i);
}

std::size_t CellMap::index(Coord cell) const {
  const Coord d = box_.dims(), c = cell - box_.min;
  return (to_index(c.x) * to_index(d.y) + to_index(c.y)) * to_index(d.z) + to_index(c.z);
}

std::int32_t CellMap::find(Coord origin) const {
  const Coord cell = shift_down(origin, 3);
  return box_.contains(cell) ? cells_[index(cell)] : -1;
}

std::vector<std::uint8_t> CellMap::dilated(std::span<const std::uint8_t> marked) const {
  OSTEON_CHECK(marked.size() == count_);
  std::vector<std::uint8_t> now(cells_.size(), 0), next(cells_.size());
  for (std::size_t i = 0; i < cells_.size(); ++i)
    if (cells_[i] >= 0) now[i] = marked[to_index(cells_[i])];
  const Coord d = box_.dims();
  // The border is never marked, so wrapping around it has no effect.
  for (const std::size_t stride : {to_index(d.y) * to_index(d.z), to_index(d.z), std::size_t{1}}) {
    for (std::size_t i = 0; i < now.size(); ++i)
      next[i] = static_cast<std::uint8_t>(now[i] | (i >= stride ? now[i - stride] : 0) |
                                          (i + stride < now.size() ? now[i + stride] : 0));
    std::swap(now, next);
  }
  std::vector<std::uint8_t> result(count_, 0);
  for (std::size_t i = 0; i < cells_.size(); ++i)
    if (cells_[i] >= 0) result[to_index(cells_[i])] = now[i];
  return result;
}

CoordBox cell_box(Coord origin, int level) {
  const Coord first = (1 << level) * origin;
  const std::int32_t n = (kLeafSize << level) - 1;
  return {first, first + Coord{n, n, n}};
}

int cut_level(const CutField& field, Coord origin) {
  int level = kLevels - 1;
  while (level > 0 && !field.has_cuts(level, cell_box(origin, level))) --level;
  return level;
}

Fragment cut_out(const CutField& field, const CellMap& map, std::span<const PieceCell> cells) {
  OSTEON_CHECK(cells.size() == map.size());
  Fragment fragment;
  std::vector<std::uint8_t> piece(cells.size()), rest(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    piece[i] = cells[i].has_piece;
    rest[i] = cells[i].has_rest;
  }
  const std::vector<std::uint8_t> near_piece = map.dilated(piece), near_rest = map.dilated(rest);
  Measure measure(field, map, cells);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!near_piece[i]) continue;
    const PieceCell& cell = cells[i];
    if (!cell.has_piece || !is_deep(map, cells, cell)) {
      measure.add(cell, fragment);
      continue;
    }
    const double pitch = level_pitch_mm(field.bone().pitch_mm(), cell.level);
    const CoordBox box = cell_box(cell.origin, cell.level);
    fragment.volume_mm3 += static_cast<double>(kLeafVoxels << (3 * cell.level)) * pitch * pitch * pitch;
    fragment.bounds.include(position_mm(box.min, pitch));
    fragment.bounds.include(position_mm(box.max, pitch));
  }
  int level = 0;
  std::vector<std::uint8_t> only_piece(cells.size()), only_rest(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (near_piece[i] && near_rest[i]) level = std::max(level, cells[i].level);
    only_piece[i] = near_piece[i] && !near_rest[i];
    only_rest[i] = near_rest[i] && !near_piece[i];
  }
  SidesOf sides;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (near_piece[i] && near_rest[i]) sides.emplace(cells[i].origin, sides_of(field, cells[i], level));
  settle_unknown(sides);
  add_constants(field, map, cells, only_piece, fragment.taken);
  add_constants(field, map, cells, only_rest, fragment.left);
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (near_piece[i] && near_rest[i]) add_interface(field, sides, level, cells[i].origin, fragment);
  sort_and_unite(fragment.taken);
  sort_and_unite(fragment.left);
  return fragment;
}

}  // namespace osteon
