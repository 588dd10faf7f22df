// Milling, equations (7.7) and (7.8): tangential force F_t = K_t MRR / f and radial force F_r = K_r F_t (Yang and Chen
// 2003, Choi and Jerard 1998; Eriksson 2005 for burring bone). With f as the feed, as printed, the force is K_t times
// the swept area. Then it does not depend on the feed, and no feed follows from a force. So f is read as the cutting
// speed: F_t = K_t MRR / v_c + edge force, with the removal rate MRR in mm3/s and v_c = omega r of each point in mm/s.
// The page defines F_r from all of F_t. We leave out the ploughing of the edges, which takes no chip [A].
// [A] K_t 200 N/mm2 at 1.9 g/cm3, K_r 0.5, 0.01 N for each mm of ploughing edge. All grow with density like Chi's
// thrust.
#pragma once
#include "common/core/units.hpp"
#include "common/mechanics/feed_law.hpp"

namespace osteon {

struct MillingParams {
  double diameter_mm = 5.0;
  double pressure_n_per_mm2 = 200.0;  // K_t at 1.9 g/cm3 [A]
  double wear = 1.0;                  // 1 sharp
  double pole_radius = 0.15;          // fraction of the radius below which the cutting speed counts as constant [A]
  double radial_ratio = 0.5;          // K_r [A]
  double edge_n_per_mm = 0.01;        // at 1.9 g/cm3: half of a 5 mm burr with eight flutes rubs below 0.3 N [A]
  double heel_mm_per_rev = 0.1;       // how far the teeth stand out, as feed per turn [A]
};

// Contribution of one patch of the burr's surface: its area projected on the feed, its distance from the axis, its
// density. For a sharp tool, whatever `params.wear` is. The sum over patches is N·s/mm per rad/s of spindle speed:
// divide by omega. Near the pole the cutting speed vanishes and the resistance grows, so a burr does not cut there.
[[nodiscard]] double milling_resistance(const MillingParams& params, double projected_area_mm2, double axis_distance_mm,
                                        double density_g_cm3) noexcept;
// Force of ploughing edges, which take no chip: k_e L.
[[nodiscard]] Newtons milling_ploughing(const MillingParams& params, double edge_length_mm,
                                        GramsPerCm3 density) noexcept;
// (7.7) at a moment, along the feed. `resistance_sum` is the sum of milling_resistance(). The length is that of the
// edges in bone.
[[nodiscard]] FeedLaw milling_law(const MillingParams& params, RevolutionsPerMinute speed, double resistance_sum,
                                  double edge_length_mm, GramsPerCm3 density) noexcept;
// (7.8): force across the feed, of the cutting part.
[[nodiscard]] Newtons milling_radial(const MillingParams& params, Newtons tangential_that_cuts) noexcept;

}  // namespace osteon
