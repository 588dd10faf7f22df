// Reaming as milling along the axis [A]. Every millimetre of cutting edge takes a chip as thick as the feed of a tooth,
// t = 60 v / (N Z), and needs the tangential force K_t t + k_e. The radial force, which here acts along the feed, is
// K_r times the cutting part. Sum over the engaged edge length L of all teeth: thrust = (K_r K_t t + k_e) L. It is the
// milling law of the same face: the edges of Z teeth over a ring of radius r and width dr sweep 2 pi r dr, and their
// length is Z dr.
#pragma once
#include "common/core/units.hpp"
#include "common/mechanics/feed_law.hpp"

namespace osteon {

struct ReamingParams {
  double teeth = 40;
  double pressure_n_per_mm2 = 200.0;  // K_t at 1.9 g/cm3 [A]
  double radial_ratio = 0.5;          // K_r [A]
  double edge_n_per_mm = 0.01;        // k_e at 1.9 g/cm3 [A]
  double heel_mm_per_rev = 1.0;       // how far the teeth stand out, as feed per turn [A]
  double wear = 1.0;                  // 1 sharp
};

[[nodiscard]] FeedLaw reaming_law(const ReamingParams& params, RevolutionsPerMinute speed, double edge_length_mm,
                                  GramsPerCm3 density) noexcept;
// Torque of the tangential force for a thrust, at its mean distance from the axis.
[[nodiscard]] NewtonMillimetres reaming_torque(const ReamingParams& params, Newtons thrust, double edge_length_mm,
                                               GramsPerCm3 density, double arm_mm) noexcept;

}  // namespace osteon
