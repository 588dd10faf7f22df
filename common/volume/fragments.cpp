#include "common/volume/fragments.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/fragment_masks.hpp"
#include "common/volume/solid_labels.hpp"

namespace osteon {
namespace {

constexpr std::int32_t kNoPart = -1;  // no bone of the case
constexpr std::int32_t kSeveralParts = -2;
constexpr int kFinest = kLevels - 1;

// Linked components: one of a cell, and one of the next cell along an axis.
using Link = std::pair<std::uint16_t, std::uint16_t>;

struct Cell {
  Coord origin;                                     // samples of level 0
  int level = 0;                                    // the level at which it is labelled
  bool full = false;                                // completely solid
  std::vector<std::uint32_t> counts;                // samples of each component
  std::vector<std::int32_t> parts;                  // of each component, if the cell has several parts
  std::array<std::vector<std::uint16_t>, 6> faces;  // labels of the first and last layer along x, y, z; none if full
  std::array<std::int32_t, 3> next{-1, -1, -1}, previous{-1, -1, -1};  // cells along x, y, z
  std::array<std::vector<Link>, 3> links;                              // to the next ones
  std::int32_t home = kNoPart;                                         // part of the case, or kSeveralParts

  [[nodiscard]] std::uint16_t face(int which, std::size_t i) const {
    if (full) return 1;
    const auto& labels = faces[to_index(which)];
    return labels.empty() ? std::uint16_t{0} : labels[i];
  }
};

// Where two bones of the case are close to each other: the bone of each sample.
struct SharedHome {
  std::vector<std::uint16_t> labels;  // of the case's samples
  std::vector<std::int32_t> parts;    // of each label, from 1
};

// The component that each node (a cell's component) belongs to.
struct Walk {
  std::vector<std::uint32_t> first_node;  // of each cell, and one past the last
  std::vector<std::uint32_t> root;        // the first node of the same component
};

// The layer of labels at one end of an axis.
std::vector<std::uint16_t> face_labels(const std::vector<std::uint16_t>& labels, std::int32_t n, int axis, bool last) {
  std::vector<std::uint16_t> face;
  face.reserve(to_index(n * n));
  const std::int32_t fixed = last ? n - 1 : 0;
  for (std::int32_t u = 0; u < n; ++u)
    for (std::int32_t v = 0; v < n; ++v) {
      const Coord c = axis == 0 ? Coord{fixed, u, v} : axis == 1 ? Coord{u, fixed, v} : Coord{u, v, fixed};
      face.push_back(labels[to_index((c.x * n + c.y) * n + c.z)]);
    }
  return face;
}

}  // namespace

struct FragmentFinder::Parts {
  std::vector<Cell> cells;  // all leaves of the case with bone, sorted
  CellMap map;              // finds them by origin
  std::map<std::int32_t, SharedHome> shared;
  bool links_changed = true;
  bool outstanding = false;  // the last search found pieces

  // Labels a cell's samples. Without a field: at level 0, from the case alone.
  void label(Cell& cell, const CutField* field, const Case& bone) const {
    cell.level = field ? cut_level(*field, cell.origin) : 0;
    const CoordBox box = cell_box(cell.origin, cell.level);
    const std::int32_t n = kLeafSize << cell.level;
    std::vector<float> f(to_index(n * n * n));
    if (field)
      field->gather_solid(cell.level, box, f);
    else
      bone.gather_surface(box, f);
    for (auto& face : cell.faces) face.clear();
    cell.counts.clear();
    cell.parts.clear();
    const auto solid = std::ranges::count_if(f, [](float v) { return v < 0.0f; });
    cell.full = static_cast<std::size_t>(solid) == f.size();
    if (cell.full) cell.counts = {static_cast<std::uint32_t>(solid)};
    std::vector<std::uint16_t> labels;
    if (!cell.full && solid > 0) {
      cell.counts.assign(to_index(label_solid({n, n, n}, f, labels)), 0);
      for (const std::uint16_t l : labels)
        if (l) ++cell.counts[l - 1u];
      for (int which = 0; which < 6; ++which)
        cell.faces[to_index(which)] = face_labels(labels, n, which / 2, which % 2 == 1);
    }
    if (cell.home == kSeveralParts) vote(cell, labels);
  }

  // Each component belongs to the part of the case that contains most of its samples.
  void vote(Cell& cell, const std::vector<std::uint16_t>& labels) const {
    const SharedHome& home = shared.at(map.find(cell.origin));
    const std::int32_t n = kLeafSize << cell.level;
    std::vector<std::map<std::int32_t, int>> votes(cell.counts.size());
    for (std::int32_t x = 0; x < n; ++x)
      for (std::int32_t y = 0; y < n; ++y)
        for (std::int32_t z = 0; z < n; ++z) {
          const std::uint16_t label = cell.full        ? std::uint16_t{1}
                                      : labels.empty() ? std::uint16_t{0}
                                                       : labels[to_index((x * n + y) * n + z)];
          const Coord c = shift_down({x, y, z}, cell.level);
          const std::uint16_t in_case = home.labels[to_index((c.x * kLeafSize + c.y) * kLeafSize + c.z)];
          if (label && in_case) ++votes[label - 1u][home.parts[in_case]];
        }
    for (const auto& found : votes) {
      const auto most = std::ranges::max_element(found, {}, [](const auto& v) { return v.second; });
      cell.parts.push_back(most == found.end() ? kNoPart : most->first);
    }
  }

  // Links of a cell to the next one along an axis, at the samples of the coarser one.
  [[nodiscard]] std::vector<Link> links_of(const Cell& cell, int axis) const {
    std::vector<Link> links;
    if (cell.next[to_index(axis)] < 0) return links;
    const Cell& next = cells[to_index(cell.next[to_index(axis)])];
    if (cell.counts.empty() || next.counts.empty()) return links;
    if (cell.full && next.full) return {{1, 1}};
    const int level = std::min(cell.level, next.level);
    const std::int32_t n = kLeafSize << level;
    const auto index = [&](const Cell& c, std::int32_t u, std::int32_t v) {
      const int shift = c.level - level;
      return to_index(((u << shift) * (kLeafSize << c.level)) + (v << shift));
    };
    for (std::int32_t u = 0; u < n; ++u)
      for (std::int32_t v = 0; v < n; ++v) {
        const Link link{cell.face(2 * axis + 1, index(cell, u, v)), next.face(2 * axis, index(next, u, v))};
        if (link.first && link.second && (links.empty() || links.back() != link)) links.push_back(link);
      }
    std::ranges::sort(links);
    links.erase(std::unique(links.begin(), links.end()), links.end());
    return links;
  }

  [[nodiscard]] Walk walk() const {
    Walk result;
    std::uint32_t nodes = 0;
    result.first_node.reserve(cells.size() + 1);
    for (const Cell& cell : cells) {
      result.first_node.push_back(nodes);
      nodes += static_cast<std::uint32_t>(cell.counts.size());
    }
    result.first_node.push_back(nodes);
    UnionFind sets;
    sets.reset(nodes);
    for (std::size_t i = 0; i < cells.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const Link& link : cells[i].links[axis])
          sets.unite(result.first_node[i] + link.first - 1u,
                     result.first_node[to_index(cells[i].next[axis])] + link.second - 1u);
    result.root.resize(nodes);
    for (std::uint32_t node = 0; node < nodes; ++node) result.root[node] = sets.find(node);
    return result;
  }

  // Finds the parts of the case, before any cut.
  void find_home() {
    const Walk all = walk();
    for (std::size_t i = 0; i < cells.size(); ++i) {
      Cell& cell = cells[i];
      const auto part = [&](std::size_t component) {
        return static_cast<std::int32_t>(all.root[all.first_node[i] + component]);
      };
      for (std::size_t c = 0; c < cell.counts.size(); ++c)
        cell.home = cell.home == kNoPart || cell.home == part(c) ? part(c) : kSeveralParts;
    }
  }

  // The roots of the pieces: of every part of the case, all but the largest component. Of equal ones the first stays.
  [[nodiscard]] std::vector<std::uint32_t> pieces(const Walk& all) const {
    struct Component {
      std::uint64_t volume = 0;  // samples of the finest level
      std::int32_t part = kNoPart;
      std::uint64_t in_part = 0;
    };
    std::map<std::pair<std::uint32_t, std::int32_t>, std::uint64_t>
        elsewhere;  // volume in a second part, which is rare
    std::vector<Component> components(all.root.size());
    for (std::size_t i = 0; i < cells.size(); ++i)
      for (std::size_t c = 0; c < cells[i].counts.size(); ++c) {
        const std::uint32_t root = all.root[all.first_node[i] + c];
        const std::uint64_t volume = std::uint64_t{cells[i].counts[c]} << (3 * (kFinest - cells[i].level));
        Component& component = components[root];
        component.volume += volume;
        const std::int32_t part = cells[i].home == kSeveralParts ? cells[i].parts[c] : cells[i].home;
        if (part == kNoPart) continue;
        if (component.part == kNoPart) component.part = part;
        if (component.part == part)
          component.in_part += volume;
        else
          elsewhere[{root, part}] += volume;
      }
    for (const auto& [key, volume] : elsewhere)
      if (volume > components[key.first].in_part)
        components[key.first].part = key.second, components[key.first].in_part = volume;

    std::map<std::int32_t, std::uint32_t> largest;
    std::vector<std::uint32_t> roots;
    for (std::uint32_t root = 0; root < components.size(); ++root) {
      if (components[root].volume == 0) continue;
      roots.push_back(root);
      if (components[root].part == kNoPart) continue;
      const auto [best, first] = largest.try_emplace(components[root].part, root);
      if (!first && components[root].volume > components[best->second].volume) best->second = root;
    }
    std::erase_if(roots, [&](std::uint32_t root) {
      const auto best = largest.find(components[root].part);
      return best != largest.end() && best->second == root;
    });
    std::ranges::stable_sort(roots, std::greater{}, [&](std::uint32_t root) { return components[root].volume; });
    return roots;
  }
};

FragmentFinder::FragmentFinder(const CutField& field) : parts_(std::make_unique<Parts>()) {
  const Case& bone = field.bone();
  const CoordBox bounds = bone.bounds_samples();
  for (std::int32_t x = bounds.min.x; x <= bounds.max.x; x += kLeafSize)
    for (std::int32_t y = bounds.min.y; y <= bounds.max.y; y += kLeafSize)
      for (std::int32_t z = bounds.min.z; z <= bounds.max.z; z += kLeafSize)
        if (bone.has_bone({{x, y, z}, {x, y, z}})) {
          parts_->cells.emplace_back();
          parts_->cells.back().origin = {x, y, z};
        }
  std::vector<Coord> origins;
  for (const Cell& cell : parts_->cells) origins.push_back(cell.origin);
  parts_->map = CellMap(bounds, origins);
  for (std::size_t i = 0; i < parts_->cells.size(); ++i) {
    Cell& cell = parts_->cells[i];
    const Coord steps[3] = {{kLeafSize, 0, 0}, {0, kLeafSize, 0}, {0, 0, kLeafSize}};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      cell.next[axis] = parts_->map.find(cell.origin + steps[axis]);
      if (cell.next[axis] >= 0) parts_->cells[to_index(cell.next[axis])].previous[axis] = static_cast<std::int32_t>(i);
    }
    parts_->label(cell, nullptr, bone);
  }
  const auto link_all = [&] {
    for (Cell& cell : parts_->cells)
      for (int axis = 0; axis < 3; ++axis) cell.links[to_index(axis)] = parts_->links_of(cell, axis);
  };
  link_all();
  parts_->find_home();

  // Where two bones share a cell: the bone of each sample.
  const Walk all = parts_->walk();
  for (std::size_t i = 0; i < parts_->cells.size(); ++i) {
    Cell& cell = parts_->cells[i];
    if (cell.home != kSeveralParts) continue;
    SharedHome home;
    std::vector<float> s(kLeafVoxels);
    bone.gather_surface(cell_box(cell.origin, 0), s);
    label_solid({kLeafSize, kLeafSize, kLeafSize}, s, home.labels);
    home.parts.push_back(kNoPart);
    for (std::size_t c = 0; c < cell.counts.size(); ++c)
      home.parts.push_back(static_cast<std::int32_t>(all.root[all.first_node[i] + c]));
    parts_->shared.emplace(static_cast<std::int32_t>(i), std::move(home));
    parts_->vote(cell, parts_->shared.at(static_cast<std::int32_t>(i)).labels);
  }

  // Applies earlier cuts.
  for (Cell& cell : parts_->cells) {
    bool cut = false;
    for (int level = 0; level < kLevels && !cut; ++level)
      cut = field.has_cuts(level, cell_box(cell.origin, level).grown(1));
    if (cut) parts_->label(cell, &field, bone);
  }
  link_all();
}
FragmentFinder::~FragmentFinder() = default;
FragmentFinder::FragmentFinder(FragmentFinder&&) noexcept = default;
FragmentFinder& FragmentFinder::operator=(FragmentFinder&&) noexcept = default;

TouchCost FragmentFinder::touch(const CutField& field, int level, const std::vector<Coord>& changed_leaves) {
  OSTEON_CHECK(level >= 0 && level < kLevels);
  TouchCost cost;
  std::vector<std::int32_t> touched;
  for (const Coord origin : changed_leaves) {
    // A sample of the level affects the finer samples of the cell before it.
    const Coord own = floor_to(shift_down(origin, level), kLeafSize),
                low = floor_to(shift_down(origin - Coord{1, 1, 1}, level), kLeafSize);
    for (std::int32_t x = low.x; x <= own.x; x += kLeafSize)
      for (std::int32_t y = low.y; y <= own.y; y += kLeafSize)
        for (std::int32_t z = low.z; z <= own.z; z += kLeafSize) {
          const std::int32_t cell = parts_->map.find({x, y, z});
          if (cell < 0) continue;
          if (Coord{x, y, z} == own || parts_->cells[to_index(cell)].level > level) touched.push_back(cell);
        }
  }
  std::ranges::sort(touched);
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  std::vector<std::pair<std::int32_t, std::size_t>> borders;
  for (const std::int32_t i : touched) {
    Cell& cell = parts_->cells[to_index(i)];
    const std::size_t before = cell.counts.size();
    const std::vector<std::int32_t> parts_before = cell.parts;
    parts_->label(cell, &field, field.bone());
    cost.links |= cell.counts.size() != before || cell.parts != parts_before;
    ++cost.cells;
    cost.samples += to_index(kLeafVoxels) << (3 * cell.level);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      borders.emplace_back(i, axis);
      if (cell.previous[axis] >= 0) borders.emplace_back(cell.previous[axis], axis);
    }
  }
  std::ranges::sort(borders);
  borders.erase(std::unique(borders.begin(), borders.end()), borders.end());
  for (const auto& [i, axis] : borders) {
    Cell& cell = parts_->cells[to_index(i)];
    std::vector<Link> links = parts_->links_of(cell, static_cast<int>(axis));
    cost.links |= links != cell.links[axis];
    cell.links[axis] = std::move(links);
  }
  parts_->links_changed |= cost.links;
  return cost;
}

std::vector<Fragment> FragmentFinder::take_fragments(const CutField& field) {
  std::vector<Fragment> fragments;
  if (!parts_->links_changed && !parts_->outstanding) return fragments;
  const Walk all = parts_->walk();
  const std::vector<std::uint32_t> roots = parts_->pieces(all);
  parts_->links_changed = false;
  parts_->outstanding = !roots.empty();
  for (const std::uint32_t root : roots) {
    std::vector<PieceCell> piece_cells;
    piece_cells.reserve(parts_->cells.size());
    for (std::size_t i = 0; i < parts_->cells.size(); ++i) {
      const Cell& cell = parts_->cells[i];
      PieceCell seen{cell.origin, cell.level, cell.full, {}, false, false};
      for (std::size_t c = 0; c < cell.counts.size(); ++c) {
        const bool in_piece = all.root[all.first_node[i] + c] == root;
        seen.in_piece.push_back(in_piece);
        (in_piece ? seen.has_piece : seen.has_rest) = true;
      }
      piece_cells.push_back(std::move(seen));
    }
    fragments.push_back(cut_out(field, parts_->map, piece_cells));
  }
  return fragments;
}

}  // namespace osteon
