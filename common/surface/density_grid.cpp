#include "common/surface/density_grid.hpp"

#include <cmath>

namespace osteon {

namespace {
constexpr double kFarthestSample = 1 << 30;  // its neighbours are numbers of 32 bits too
}

double DensityGrid::g_cm3(const Vec3& point_mm) const {
  const Vec3 at = point_mm / pitch_mm_;
  if (!(at.cwiseAbs().maxCoeff() < kFarthestSample)) return 0.0;
  const Vec3 floor = at.array().floor();
  const Vec3 t = at - floor;
  const Coord first{static_cast<std::int32_t>(floor.x()), static_cast<std::int32_t>(floor.y()),
                    static_cast<std::int32_t>(floor.z())};
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Coord sample{first.x + (corner & 1), first.y + (corner >> 1 & 1), first.z + (corner >> 2 & 1)};
    const auto leaf = leaves_.find(shift_down(sample, 3));
    if (leaf == leaves_.end()) continue;
    const double weight = ((corner & 1) != 0 ? t.x() : 1.0 - t.x()) * ((corner & 2) != 0 ? t.y() : 1.0 - t.y()) *
                          ((corner & 4) != 0 ? t.z() : 1.0 - t.z());
    sum += weight * leaf->second[to_index((sample.x & 7) * 64 + (sample.y & 7) * 8 + (sample.z & 7))];
  }
  return kDensityStep_g_cm3 * sum;
}

}  // namespace osteon
