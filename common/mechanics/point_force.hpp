// Forces of single contact points: spring and damper, equations (7.9) to (7.11) (Avila and Sobierajski 1996, McNeely,
// Puterbaugh and Troy 1999, Hua and Qin 2002), and the dissertation's multi-point force, (7.12) and (7.14); it has no (7.13).
//
// Both know neither speed nor diameter of the tool. Their constants are fitted [A] to Chi's thrust (7.3) of a 3.2 mm drill
// at 1000 rpm and 1 mm/s in cortical bone, 28.9 N.
#pragma once
#include <span>

#include "common/geometry/pose.hpp"

namespace osteon {

struct SpringDamperParams {
  double spring_n = 5.0;             // t_s at 1.9 g/cm3 [A]; both grow with density as (7.3) does [A]
  double damper_n_s_per_mm = 24.0;   // t_r at 1.9 g/cm3 [A]
  double wear = 1.0;                 // 1 sharp
};
// (7.9): -t_r V + t_s N / |N|, of the bone on the tool. `normal`: of the surface, of any length, as the density's gradient
// gives it; where that vanishes, inside even bone, there is no direction to push in and the spring is left out.
[[nodiscard]] Vec3 spring_damper_force_n(const SpringDamperParams& params, const Vec3& velocity_mm_per_s, const Vec3& normal,
                                         double density_g_cm3) noexcept;
// The same against a feed along the surface's normal.
[[nodiscard]] double spring_damper_thrust_n(const SpringDamperParams& params, double feed_mm_per_s,
                                            double density_g_cm3) noexcept;
// Solved for the feed: (F - t_s) / t_r, zero below t_s.
[[nodiscard]] double spring_damper_feed_mm_per_s(const SpringDamperParams& params, double force_n,
                                                 double density_g_cm3) noexcept;

struct MultiPointParams {
  double stiffness = 17.7;  // K_1, N·s/mm per g/cm3 [A]
  double wear = 1.0;        // 1 sharp
};
// An active point inside bone.
struct CuttingPoint {
  Vec3 inward;              // unit normal into the tool, n
  Vec3 velocity_mm_per_s;   // its own, which turning makes differ from the tool's
  double share = 0;         // K_2: its area over that of the active surface
  double density_g_cm3 = 0; // D
};
// (7.14), the sum of (7.12) over the points, of the bone on the tool. As printed, (7.12) pushes during retraction too, for
// it knows the speed's amount only; here a point counts where it moves into bone, -n·v > 0.
[[nodiscard]] Vec3 multi_point_force_n(const MultiPointParams& params, std::span<const CuttingPoint> points) noexcept;
// Solved for the feed along one direction: v = F / (K_1 sum K_2 D max(0, -n·direction)).
[[nodiscard]] double multi_point_feed_mm_per_s(const MultiPointParams& params, double force_n, double directed_density) noexcept;

}  // namespace osteon
