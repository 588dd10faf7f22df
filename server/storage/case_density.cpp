#include "server/storage/case_density.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace osteon {

namespace {

// The leaves of every `every`-th sample that have bone.
std::vector<Coord> bone_leaves(const Case& bone, int every) {
  const CoordBox all = bone.bounds_samples();
  const int size = 8 * every;
  const auto down = [size](int sample) { return static_cast<int>(std::floor(static_cast<double>(sample) / size)); };
  std::vector<Coord> leaves;
  for (int x = down(all.min.x); x <= down(all.max.x); ++x)
    for (int y = down(all.min.y); y <= down(all.max.y); ++y)
      for (int z = down(all.min.z); z <= down(all.max.z); ++z) {
        const Coord first{x * size, y * size, z * size};
        if (bone.has_bone({first, {first.x + size - 1, first.y + size - 1, first.z + size - 1}}))
          leaves.push_back({x, y, z});
      }
  return leaves;
}

}  // namespace

DensityGrid density_of(const Case& bone) {
  int every = 1;
  std::vector<Coord> leaves = bone_leaves(bone, every);
  while (leaves.size() > kMostDensityLeaves) leaves = bone_leaves(bone, every *= 2);
  DensityGrid grid(every * bone.pitch_mm());
  const int size = 8 * every;
  std::vector<float> samples(to_index(size) * to_index(size) * to_index(size));
  for (const Coord& leaf : leaves) {
    const Coord first{leaf.x * size, leaf.y * size, leaf.z * size};
    bone.gather_density({first, {first.x + size - 1, first.y + size - 1, first.z + size - 1}}, samples);
    DensityLeaf steps;
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y)
        for (int z = 0; z < 8; ++z) {
          const float g_cm3 = samples[to_index((x * every * size + y * every) * size + z * every)];
          steps[to_index(x * 64 + y * 8 + z)] =
              static_cast<std::uint8_t>(std::clamp(std::lround(g_cm3 / kDensityStep_g_cm3), 0L, 255L));
        }
    grid.add(leaf, steps);
  }
  return grid;
}

}  // namespace osteon
