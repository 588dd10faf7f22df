// Burring after Agus, Giachetti, Gobbetti, Zanetti and Zorcolo (2002), equations (7.4) to (7.6). A sphere of radius R
// that turns at omega is pressed h deep into bone. Hertz gives the elastic force F_e = C1 R^2 (h/R)^1.5, and friction
// under the contact's pressure gives F_mu. The power of that friction erodes: v = mu F omega r / (u A), with the energy
// u per unit of volume, the contact's projected area A and its mean distance r from the axis.
//
// C1 = 4/3 E* is about 25 GPa for bone, so h is some microns. A person feels the erosion, not this elastic depth. At
// the pole r = 0, so a burr does not cut there.
#pragma once
#include "common/core/units.hpp"
#include "common/mechanics/feed_law.hpp"

namespace osteon {

struct AgusParams {
  double radius_mm = 2.5;
  double elastic_n_per_mm2 = 25'000.0;  // C1
  double friction = 0.3;                // mu [A]
  double energy_n_per_mm2 = 1'000.0;    // u at 1.9 g/cm3: 1 J/mm3 [A]; grows with density like (7.3) [A]
  double wear = 1.0;                    // 1 sharp: a blunt burr needs more force for the same cutting power
  double pole_radius = 0.01;            // fraction of R below which nothing is cut
};

// (7.4) and its inverse, h = R (F / (C1 R^2))^(2/3).
[[nodiscard]] Newtons agus_elastic_force(const AgusParams& params, double depth_mm) noexcept;
[[nodiscard]] double agus_depth_mm(const AgusParams& params, Newtons force) noexcept;
// (7.5): friction of a contact whose middle is `axis_distance_mm` from the spindle's axis, along omega x r there. mu F
// far from the pole; less near the pole, where directions in the contact differ; zero at the pole. [haptic]
[[nodiscard]] Newtons agus_friction(const AgusParams& params, Newtons normal, double axis_distance_mm) noexcept;
// Feed under a force, not limited. `area_mm2` is projected on the feed.
[[nodiscard]] MillimetresPerSecond agus_erosion(const AgusParams& params, RevolutionsPerMinute speed, Newtons force,
                                                double axis_distance_mm, double area_mm2, GramsPerCm3 density) noexcept;

}  // namespace osteon
