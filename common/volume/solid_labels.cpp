#include "common/volume/solid_labels.hpp"

#include <numeric>

#include "common/core/check.hpp"

namespace osteon {

void UnionFind::reset(std::size_t count) {
  parent_.resize(count);
  std::iota(parent_.begin(), parent_.end(), 0u);
}

std::uint32_t UnionFind::add() {
  parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
  return parent_.back();
}

std::uint32_t UnionFind::find(std::uint32_t i) {
  while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
  return i;
}

void UnionFind::unite(std::uint32_t a, std::uint32_t b) {
  a = find(a);
  b = find(b);
  if (a < b) parent_[b] = a;
  if (b < a) parent_[a] = b;
}

int label_solid(Coord dims, std::span<const float> solid_mm, std::vector<std::uint16_t>& labels) {
  const std::size_t nz = static_cast<std::size_t>(dims.z), nyz = static_cast<std::size_t>(dims.y) * nz;
  OSTEON_CHECK(solid_mm.size() == static_cast<std::size_t>(dims.x) * nyz);
  labels.assign(solid_mm.size(), 0);
  // Before they are united, at most half of the samples have separate labels.
  OSTEON_CHECK(solid_mm.size() < 2u * 65535u);
  UnionFind sets;
  sets.add();
  std::size_t i = 0;
  for (std::int32_t x = 0; x < dims.x; ++x)
    for (std::int32_t y = 0; y < dims.y; ++y) {
      std::uint16_t before = 0;
      for (std::int32_t z = 0; z < dims.z; ++z, ++i) {
        if (!(solid_mm[i] < 0.0f)) {
          before = 0;
          continue;
        }
        const std::uint16_t below = y > 0 ? labels[i - nz] : std::uint16_t{0},
                            beside = x > 0 ? labels[i - nyz] : std::uint16_t{0};
        std::uint16_t label = before ? before : below ? below : beside;
        if (!label) label = static_cast<std::uint16_t>(sets.add());
        if (below && below != label) sets.unite(label, below);
        if (beside && beside != label) sets.unite(label, beside);
        labels[i] = before = label;
      }
    }
  std::vector<std::uint16_t> name;
  int count = 0;
  for (std::uint16_t& label : labels) {
    if (!label) continue;
    const std::uint32_t root = sets.find(label);
    if (root >= name.size()) name.resize(root + 1, 0);
    if (!name[root]) name[root] = static_cast<std::uint16_t>(++count);
    label = name[root];
  }
  return count;
}

}  // namespace osteon
