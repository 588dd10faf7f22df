// Drilling thrust after Chi, equation (7.3): T = 134.6 N^-0.3327 v^0.5189 rho^1.1841, with T in newtons, N in rpm, v in
// mm/s and rho in g/cm3. Published for 0.3 to 2.0 g/cm3, about 500 to 3000 rpm and 0.5 to 3 mm/s; extrapolated outside
// that range. The source does not state the drill's diameter, so thrust is scaled by D / 3.2 mm [A].
// haptic_client/contact/cutting_force.cpp applies the law to the bone that the drill engages.
#pragma once
#include "common/core/units.hpp"
#include "common/mechanics/feed_law.hpp"

namespace osteon {

struct DrillingParams {
  double diameter_mm = 3.2;
  double point_angle_rad = 2.0594885173533;  // 118 degrees
  double wear = 1.0;                         // 1 sharp; a blunt drill needs about twice the thrust
  double threshold_n = 1.0;                  // rubs below this at 1.9 g/cm3, whole point engaged, 3.2 mm [A]
  double heel_mm_per_rev = 0.33 * 3.2;       // feed at which the drill's heel touches the cut surface: 0.33 D
};

inline constexpr double kReferenceDiameter_mm = 3.2;  // of the drill for which (7.3) is taken

// Below this speed the spindle counts as stopped, because (7.3) has no limit at N = 0.
inline constexpr double kMinCuttingRpm = 50.0;

// Torque for a thrust, both from one cutting force on two lips: M = T D / (4 sin(beta/2)).
[[nodiscard]] NewtonMillimetres drilling_torque(const DrillingParams& params, Newtons thrust) noexcept;
// (7.3) at a moment. `engaged` is the fraction (0 to 1) of the point's projected area in bone of that density.
[[nodiscard]] FeedLaw drilling_law(const DrillingParams& params, RevolutionsPerMinute speed, GramsPerCm3 density,
                                   double engaged) noexcept;

}  // namespace osteon
