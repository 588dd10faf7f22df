// How many pieces of solid samples there are in a box.
#pragma once
#include <cstdio>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "common/geometry/lattice.hpp"
#include "common/phantoms/phantom_bone.hpp"

namespace osteon::phantoms {

// Islands are counted again on finer lattices down to about this one, because bone may be thinner than a coarse one.
inline constexpr double kFinest_mm = 0.6;

struct Island {
  Coord first;  // of its samples
  int samples = 0;
};

// Samples below 0 that share faces are one piece. z fastest.
[[nodiscard]] inline std::vector<Island> find_islands(Coord dims, std::span<const float> solid_mm) {
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
  std::vector<Island> islands;
  for (int x = 0; x < dims.x; ++x)
    for (int y = 0; y < dims.y; ++y)
      for (int z = 0; z < dims.z; ++z) {
        if (visit({x, y, z})) islands.push_back({{x, y, z}, 0});
        while (!open.empty()) {
          const Coord c = open.back();
          open.pop_back();
          ++islands.back().samples;
          for (const Coord step : {Coord{1, 0, 0}, Coord{0, 1, 0}, Coord{0, 0, 1}}) {
            visit(c + step);
            visit(c - step);
          }
        }
      }
  return islands;
}

[[nodiscard]] inline int count_islands(Coord dims, std::span<const float> solid_mm) {
  return static_cast<int>(find_islands(dims, solid_mm).size());
}

// Where the islands are, and the parameters of a bone that has them.
[[nodiscard]] inline std::string islands_text(const PhantomBone& bone, const std::vector<Island>& islands,
                                              const Coord& from, double pitch_mm) {
  std::ostringstream text;
  for (const Island& island : islands)
    text << island.samples << " samples of " << pitch_mm << " mm from "
         << position_mm(from + island.first, pitch_mm).transpose() << " mm\n";
  for (const NamedValue& value : bone.parameters()) text << value.name << ": " << value.value << "\n";
  return text.str();
}

// Pieces of each bone on a coarse lattice around the phantom. Empty if a solid sample lies at the lattice's end,
// because then the bone is not closed.
[[nodiscard]] inline std::vector<int> islands_of(const PhantomBone& bone, double pitch_mm) {
  const CoordBox box = covering_samples(bone.bounds(), pitch_mm);
  const std::size_t bones = bone.names().size();
  std::vector<std::vector<float>> solid(bones);
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const BoneDepths at = bone.depths(position_mm({x, y, z}, pitch_mm));
        for (std::size_t i = 0; i < bones; ++i)
          solid[i].push_back(to_index(at.bone) == i + 1 ? static_cast<float>(at.surface_mm) : 1.0f);
        const bool at_end =
            x == box.min.x || y == box.min.y || z == box.min.z || x == box.max.x || y == box.max.y || z == box.max.z;
        if (at_end && at.surface_mm < 0.0) return {};
      }
  std::vector<int> islands;
  for (const std::vector<float>& one : solid) {
    const std::vector<Island> found = find_islands(box.dims(), one);
    if (found.size() > 1 && pitch_mm > kFinest_mm) return islands_of(bone, 0.6 * pitch_mm);
    if (found.size() != 1) std::printf("%s", islands_text(bone, found, box.min, pitch_mm).c_str());
    islands.push_back(static_cast<int>(found.size()));
  }
  return islands;
}

}  // namespace osteon::phantoms
