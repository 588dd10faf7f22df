// Milling, equations (7.7) and (7.8): tangential force F_t = K_t MRR / f and radial force F_r = K_r F_t (Yang and Chen
// 2003, Choi and Jerard 1998; Eriksson 2005 for burring bone). With f the feed, as printed, the force is K_t times the
// swept area: it does not depend on the feed, and no feed follows from a force. So f is read as the cutting speed:
// F_t = K_t MRR / v_c + edge force, with the removal rate MRR in mm3/s and v_c = omega r of each point in mm/s.
// [A] K_t 200 N/mm2 at 1.9 g/cm3, K_r 0.5, 0.01 N for each mm of edge that ploughs; all grow with density as Chi's thrust.
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
  double radial_ratio = 0.5;          // K_r [A]
  double edge_n_per_mm = 0.01;        // at 1.9 g/cm3: half of a 5 mm burr with eight flutes rubs below 0.3 N [A]
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

// Forward and inverse for a face of one density at one distance r from the axis: F_t = K_t A v / (omega r) + edge force,
// with the face's area A projected on the feed v and the length of edge in bone.
struct MilledFace {
  double area_mm2 = 0;
  double axis_distance_mm = 0;
  double edge_length_mm = 0;
  GramsPerCm3 density;
};
[[nodiscard]] Newtons milling_tangential(const MillingParams& params, RevolutionsPerMinute speed, MillimetresPerSecond feed,
                                         const MilledFace& face) noexcept;
[[nodiscard]] MillimetresPerSecond milling_feed(const MillingParams& params, RevolutionsPerMinute speed, Newtons tangential,
                                                const MilledFace& face) noexcept;
// (7.8): across the feed, out of the bone. The edge's ploughing has no part in it.
[[nodiscard]] Newtons milling_radial(const MillingParams& params, Newtons tangential_that_cuts) noexcept;

}  // namespace osteon
