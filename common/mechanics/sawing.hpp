// Sawing after James, Pearlman and Saigal, who cut bovine cortical bone with single teeth. From 2 to 10 micrometres of
// depth the thrust rises by 30 %, linearly, while the force along the cut stays the same (James 2013; 1700 to 7000
// mm/s, where speed has no effect). The resultant is between 8 and 11 N from 2.5 to 10 micrometres (James 2012). [A]:
// the split of the resultant, the growth with density like Chi's thrust, and the fraction of the teeth in a kerf that
// cut at a time, because the edge swings over an arc and bends.
//
// The depth of cut follows from volume. What the cutting teeth remove at their speed equals the growth of the kerf:
// v · pitch = share · depth · mean speed, for any number of teeth.
#pragma once
#include "common/core/units.hpp"
#include "common/mechanics/feed_law.hpp"

namespace osteon {

struct SawingParams {
  double stroke_mm = 7.85;  // distance of the teeth from end to end, covered twice in a period
  double tooth_pitch_mm = 1.39;
  double thrust_n = 7.5;        // of a tooth at 2 micrometres, 1.9 g/cm3 [A]
  double rise = 0.30;           // of the thrust from 2 to 10 micrometres
  double cutting_n = 4.0;       // of a tooth along its motion [A]
  double bearing_share = 0.15;  // [A]
  double most_um = 20.0;        // the gullets are full; twice the measured depth [A]
  double wear = 1.0;            // 1 sharp
};

// Force of one tooth at a depth of cut in micrometres, in newtons.
[[nodiscard]] Newtons tooth_thrust(const SawingParams& params, double depth_um, GramsPerCm3 density) noexcept;
[[nodiscard]] Newtons tooth_cutting_force(const SawingParams& params, GramsPerCm3 density) noexcept;
// Mean speed of the teeth: twice the stroke per period.
[[nodiscard]] MillimetresPerSecond tooth_speed(const SawingParams& params, RevolutionsPerMinute strokes) noexcept;
[[nodiscard]] double depth_of_cut_um(const SawingParams& params, RevolutionsPerMinute strokes,
                                     MillimetresPerSecond feed) noexcept;
// The law at a moment: `teeth` in bone.
[[nodiscard]] FeedLaw sawing_law(const SawingParams& params, RevolutionsPerMinute strokes, GramsPerCm3 density,
                                 double teeth) noexcept;
// Force along the stroke of all teeth in bone. It changes direction with them.
[[nodiscard]] Newtons sawing_cutting_force(const SawingParams& params, GramsPerCm3 density, double teeth) noexcept;
// Torque on a crank that makes the strokes, by equal power: M = F_c · stroke / pi.
[[nodiscard]] NewtonMillimetres sawing_torque(const SawingParams& params, GramsPerCm3 density, double teeth) noexcept;

}  // namespace osteon
