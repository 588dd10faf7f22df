#include "tests/integration/two_balls.hpp"

#include <cmath>

namespace osteon::test {

imaging::HuVolume two_balls() {
  imaging::HuVolume scan;
  scan.dims = {60, 60, 24};
  scan.spacing_mm = {0.9, 0.9, 1.5};
  scan.origin_mm = -0.5 * scan.spacing_mm.cwiseProduct(Vec3(59, 59, 23));
  for (int k = 0; k < scan.dims[2]; ++k)
    for (int j = 0; j < scan.dims[1]; ++j)
      for (int i = 0; i < scan.dims[0]; ++i) {
        const Vec3 at = scan.position_mm(Vec3(i, j, k));
        const bool bone = (Vec3(std::abs(at.x()), at.y(), at.z()) - Vec3(kApart_mm, 0, 0)).norm() <= kBall_mm;
        scan.values.push_back(bone ? kBall_hu : kMuscle_hu);
      }
  return scan;
}

}  // namespace osteon::test
