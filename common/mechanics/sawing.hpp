// Sawing after James, Pearlman and Saigal, who cut bovine cortical bone with single teeth: from 2 to 10 micrometres of
// depth the thrust rises by 30 %, linearly, while the force along the cut stays the same (James 2013; 1700
// to 7000 mm/s, where speed has no effect), and the resultant lies between 8 and 11 N from 2.5 to 10 micrometres
// (James 2012). [A]: the split of the resultant, the growth with density as Chi's thrust, and the share
// of the teeth in a kerf that bears at a time, for the edge swings over an arc and bends.
//
// The depth of cut follows from volume: what the bearing teeth take at their speed is what the kerf grows by,
// v · pitch = share · depth · mean speed, however many teeth there are.
#pragma once
#include "common/core/units.hpp"
#include "common/mechanics/feed_law.hpp"

namespace osteon {

struct SawingParams {
  double stroke_mm = 7.85;  // way of the teeth from end to end, twice in a period
  double tooth_pitch_mm = 1.39;
  double thrust_n = 7.5;        // of a tooth at 2 micrometres, 1.9 g/cm3 [A]
  double rise = 0.30;           // of the thrust from 2 to 10 micrometres
  double cutting_n = 4.0;       // of a tooth along its motion [A]
  double bearing_share = 0.15;  // [A]
  double most_um = 20.0;        // the gullets are full; twice what was measured [A]
  double wear = 1.0;            // 1 sharp
};

// One tooth at a depth of cut in micrometres, in newtons.
[[nodiscard]] Newtons tooth_thrust(const SawingParams& params, double depth_um, GramsPerCm3 density) noexcept;
[[nodiscard]] Newtons tooth_cutting_force(const SawingParams& params, GramsPerCm3 density) noexcept;
// Mean speed of the teeth: twice the stroke in a period.
[[nodiscard]] MillimetresPerSecond tooth_speed(const SawingParams& params, RevolutionsPerMinute strokes) noexcept;
[[nodiscard]] double depth_of_cut_um(const SawingParams& params, RevolutionsPerMinute strokes,
                                     MillimetresPerSecond feed) noexcept;
// The law of a moment: `teeth` in bone.
[[nodiscard]] FeedLaw sawing_law(const SawingParams& params, RevolutionsPerMinute strokes, GramsPerCm3 density,
                                 double teeth) noexcept;
// Along the stroke, of the teeth in bone together: it turns round with them.
[[nodiscard]] Newtons sawing_cutting_force(const SawingParams& params, GramsPerCm3 density, double teeth) noexcept;
// On a crank that makes the strokes, by equal power: M = F_c · stroke / pi.
[[nodiscard]] NewtonMillimetres sawing_torque(const SawingParams& params, GramsPerCm3 density, double teeth) noexcept;

}  // namespace osteon
