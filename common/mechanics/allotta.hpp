// Drilling after Allotta, Belmonte, Bosio and Dario (1996), equations (7.1) and (7.2): thrust T = K_s a (D/2)
// sin(beta/2) and torque M = 5 R_u a D^2/8. The feed a is in mm per REVOLUTION (not per second), the drill's diameter D
// in mm, and beta is the full angle of its point. K_s = 5 R_u is the energy per unit of volume (4.8 to 6 R_u were
// found). R_u is the ultimate stress, 130 (density/1.9)^2 MPa [A]. So the torque's work in a turn is K_s for each mm3:
// 2 pi M = K_s a pi D^2/4. M = T D / (4 sin(beta/2)), as for two lips, so drilling_torque() of the thrust is (7.2).
// Thrust is about 1.85 times Chi's at 1000 rpm, 1 mm/s and 3.2 mm. The speed matters only through the feed per turn.
#pragma once
#include "common/core/units.hpp"
#include "common/mechanics/feed_law.hpp"

namespace osteon {

struct AllottaParams {
  double diameter_mm = 3.2;
  double point_angle_rad = 2.0594885173533;  // 118 degrees
  double ultimate_mpa = 130.0;               // R_u at 1.9 g/cm3 [A]
  double energy_ratio = 5.0;                 // K_s / R_u
  double wear = 1.0;                         // 1 sharp
};

// K_s in N/mm2 = mJ/mm3.
[[nodiscard]] double allotta_energy_mj_per_mm3(const AllottaParams& params, GramsPerCm3 density) noexcept;
// (7.1). `feed_mm_per_rev`: a.
[[nodiscard]] Newtons allotta_thrust(const AllottaParams& params, double feed_mm_per_rev, GramsPerCm3 density) noexcept;

}  // namespace osteon
