// How many pieces of solid samples there are in a box.
#pragma once
#include <span>
#include <vector>

#include "common/geometry/lattice.hpp"

namespace osteon::phantoms {

// Samples below 0 that share faces are one piece. z fastest.
[[nodiscard]] inline int count_islands(Coord dims, std::span<const float> solid_mm) {
  std::vector<bool> seen(solid_mm.size(), false);
  std::vector<Coord> open;
  const auto index = [&](Coord c) {
    return (to_index(c.x) * to_index(dims.y) + to_index(c.y)) * to_index(dims.z) + to_index(c.z);
  };
  const auto visit = [&](Coord c) {
    const CoordBox box{{0, 0, 0}, {dims.x - 1, dims.y - 1, dims.z - 1}};
    if (!box.contains(c) || seen[index(c)] || solid_mm[index(c)] >= 0.0f) return false;
    seen[index(c)] = true;
    open.push_back(c);
    return true;
  };
  int islands = 0;
  for (int x = 0; x < dims.x; ++x)
    for (int y = 0; y < dims.y; ++y)
      for (int z = 0; z < dims.z; ++z) {
        islands += visit({x, y, z}) ? 1 : 0;
        while (!open.empty()) {
          const Coord c = open.back();
          open.pop_back();
          for (const Coord step : {Coord{1, 0, 0}, Coord{0, 1, 0}, Coord{0, 0, 1}}) {
            visit(c + step);
            visit(c - step);
          }
        }
      }
  return islands;
}

}  // namespace osteon::phantoms
