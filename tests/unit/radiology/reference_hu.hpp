// The attenuation of a sample straight from its definition, point by point: a second road to what BoneHu keeps.
#pragma once
#include <algorithm>
#include <cstdlib>

#include "common/radiology/attenuation.hpp"
#include "common/volume/cut_field.hpp"

namespace osteon::radiology {

[[nodiscard]] inline double solid_fraction(double distance_mm, double pitch_mm) {
  return std::clamp(0.5 - distance_mm / pitch_mm, 0.0, 1.0);
}

// Without a scan, from density with the line 0.131 + 0.001067 HU: the bone of the voxel about the sample times the part
// of it that is left in f. Means over the voxel by the trapezoidal rule, on the samples of the finest level.
[[nodiscard]] inline double reference_per_mm(const CutField& field, Coord sample) {
  const Case& bone = field.bone();
  const double h = bone.pitch_mm();
  const int level = finest_level(h), parts = 1 << level, half = parts / 2;
  const double fine = h / parts;
  const Vec3 centre = position_mm(sample, h);
  const auto weight = [&](int i) { return level > 0 && std::abs(i) == half ? 0.5 : 1.0; };
  double whole = 0.0, left = 0.0;
  for (int i = -half; i <= half; ++i)
    for (int j = -half; j <= half; ++j)
      for (int k = -half; k <= half; ++k) {
        const Vec3 p = centre + fine * Vec3(i, j, k);
        const double w = weight(i) * weight(j) * weight(k);
        whole += w * solid_fraction(bone.surface_mm(p), fine);
        left += w * solid_fraction(field.solid_mm(p), fine);
      }
  const double uncut =
      solid_fraction(bone.surface_mm(centre), h) * attenuation_per_mm((bone.density_g_cm3(centre) - 0.131) / 0.001067);
  return whole > 0.0 ? uncut * left / whole : uncut;
}

}  // namespace osteon::radiology
