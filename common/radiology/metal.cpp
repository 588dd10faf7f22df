#include "common/radiology/metal.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/check.hpp"

namespace osteon::radiology {
namespace {

// The part of a ray in a box, as positions from 0 to 1. Empty if the second is not beyond the first.
std::array<double, 2> part_in(const Box& box, const Vec3& from, const Vec3& direction) {
  double first = 0.0, last = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box.min_mm[axis] - from[axis], high = box.max_mm[axis] - from[axis], d = direction[axis];
    if (d == 0.0) {
      if (low > 0.0 || high < 0.0) return {1.0, 0.0};
      continue;
    }
    first = std::max(first, std::min(low / d, high / d));
    last = std::min(last, std::max(low / d, high / d));
  }
  return {first, last};
}

}  // namespace

double length_in(const Implicit& solid, const Vec3& from_mm, const Vec3& to_mm) {
  const Vec3 direction = to_mm - from_mm;
  const double length = direction.norm();
  const auto [first, last] = part_in(solid.bounds, from_mm, direction);
  double inside = 0.0;
  for (double at = first * length; at < last * length;) {
    const double distance = solid(from_mm + (at / length) * direction);
    const double step = std::min(std::max(std::abs(distance), kMetalStep_mm), last * length - at);
    if (distance < 0.0) inside += step;
    if (at + step == at) break;  // the rest is below the precision of a number
    at += step;
  }
  return inside;
}

void cast_metal(const ConeBeam& beam, std::span<const MetalSolid> solids, const PixelBox& box, std::span<float> metal) {
  const PixelGrid& grid = beam.detector;
  OSTEON_CHECK(metal.size() == grid.count() && grid.holds(box));
  if (box.empty()) return;
  for (int row = box.first_row; row <= box.last_row; ++row)
    std::fill(metal.data() + grid.index(box.first_column, row), metal.data() + grid.index(box.last_column, row) + 1,
              0.0f);
  for (const MetalSolid& one : solids) {
    const PixelBox shadow = shadow_of(one.solid.bounds, beam).common(box);
    for (int row = shadow.first_row; row <= shadow.last_row; ++row)
      for (int column = shadow.first_column; column <= shadow.last_column; ++column)
        metal[grid.index(column, row)] +=
            static_cast<float>(one.attenuation_per_mm * length_in(one.solid, beam.source_mm, grid.at(column, row)));
  }
}

}  // namespace osteon::radiology
