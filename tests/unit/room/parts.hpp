// Fragments for the room's tests, as the fragment detector would report them.
#pragma once
#include <algorithm>
#include <functional>

#include "server/room/room.hpp"

namespace osteon::test {

// The part of the bone whose samples satisfy `has` for their x, as a saw would separate it: by masks of whole samples.
inline Fragment part(const Case& bone, const std::function<bool(int)>& has, double volume_mm3 = 1000.0) {
  const double h = bone.pitch_mm();
  const auto band = static_cast<std::int16_t>(4 * h * 1024);
  Fragment fragment;
  fragment.volume_mm3 = volume_mm3;
  fragment.bounds = bone.bounds();
  const CoordBox all = bone.bounds_samples();
  const Coord first = floor_to(all.min, kLeafSize);
  for (int x = first.x; x <= all.max.x; x += kLeafSize)
    for (int y = first.y; y <= all.max.y; y += kLeafSize)
      for (int z = first.z; z <= all.max.z; z += kLeafSize) {
        FieldLeaf taken{BodyId{0}, 0, {x, y, z}, std::vector<std::int16_t>(kLeafVoxels)}, left = taken;
        for (std::size_t i = 0; i < kLeafVoxels; ++i) {
          const bool of_piece = has(x + static_cast<int>(i / (kLeafSize * kLeafSize)));
          taken.values[i] = of_piece ? static_cast<std::int16_t>(-band) : band;
          left.values[i] = of_piece ? band : static_cast<std::int16_t>(-band);
        }
        if (std::ranges::any_of(taken.values, [](std::int16_t v) { return v < 0; }))
          fragment.taken.push_back(std::move(taken));
        if (std::ranges::any_of(left.values, [](std::int16_t v) { return v < 0; }))
          fragment.left.push_back(std::move(left));
      }
  return fragment;
}

// One side of the plane x = 0.
inline Fragment half(const Case& bone, bool upper, double volume_mm3 = 1000.0) {
  Fragment fragment = part(
      bone, [&](int x) { return (x >= 0) == upper; }, volume_mm3);
  (upper ? fragment.bounds.min_mm : fragment.bounds.max_mm).x() = 0.0;
  return fragment;
}

}  // namespace osteon::test
