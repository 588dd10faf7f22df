// Burring as milling, equations (7.7) and (7.8) in their invertible form: tangential force = K_t · MRR / v_c with the
// removal rate MRR in mm3/s and the cutting speed v_c = omega · r of the point in mm/s. [A] K_t 200 N/mm2 at 1.9 g/cm3,
// growing with density as Chi's thrust does.
#pragma once
#include "common/core/units.hpp"
#include "common/mechanics/feed_law.hpp"

namespace osteon {

struct MillingParams {
  double diameter_mm = 5.0;
  double pressure_n_per_mm2 = 200.0;  // K_t at 1.9 g/cm3 [A]
  double wear = 1.0;                  // 1 sharp
  double threshold_n = 0.3;           // rubs below this at 1.9 g/cm3 with half the sphere engaged [A]
  double pole_radius = 0.15;          // share of the radius below which the cutting speed is taken as constant [A]
};

// What one patch of the burr's surface adds: its area projected on the feed, its distance from the axis, its density.
// The sum over patches is N·s/mm per rad/s of spindle speed: divide by omega. Near the pole the cutting speed vanishes
// and the resistance grows: there a burr does not cut.
[[nodiscard]] double milling_resistance(const MillingParams& params, double projected_area_mm2, double axis_distance_mm,
                                        double density_g_cm3) noexcept;
// The law of a moment from that sum; `engaged` is the share (0 to 1) of the leading half in bone.
[[nodiscard]] FeedLaw milling_law(const MillingParams& params, RevolutionsPerMinute speed, double resistance_sum,
                                  GramsPerCm3 density, double engaged) noexcept;
// Torque on the spindle: the tangential force at the burr's radius.
[[nodiscard]] NewtonMillimetres milling_torque(const MillingParams& params, Newtons tangential) noexcept;

}  // namespace osteon
