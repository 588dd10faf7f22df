#include "common/geometry/lattice.hpp"

#include <cmath>

namespace osteon {

CoordBox covering_samples(const Box& box, double level_pitch) {
  if (box.empty()) return {};
  const auto down = [&](double mm) { return static_cast<std::int32_t>(std::floor(mm / level_pitch)); };
  const auto up = [&](double mm) { return static_cast<std::int32_t>(std::ceil(mm / level_pitch)); };
  return {{down(box.min_mm.x()), down(box.min_mm.y()), down(box.min_mm.z())},
          {up(box.max_mm.x()), up(box.max_mm.y()), up(box.max_mm.z())}};
}

}  // namespace osteon
