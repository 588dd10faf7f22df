// Resistance that depends on neither the speed nor the diameter of the tool: spring and damper, equations (7.9) to
// (7.11) (Avila and Sobierajski 1996, McNeely, Puterbaugh and Troy 1999, Hua and Qin 2002), and the dissertation's
// multi-point force, (7.12) and (7.14); it has no (7.13). Both act along the feed, for tools that cut by being fed: all
// points move with the feed's velocity.
//
// Their constants are fitted [A] to Chi's thrust (7.3) of a 3.2 mm drill at 1000 rpm and 1 mm/s in cortical bone, 28.9
// N.
#pragma once

namespace osteon {

struct SpringDamperParams {
  double spring_n = 5.0;            // t_s at 1.9 g/cm3 [A]; both grow with density like (7.3) [A]
  double damper_n_s_per_mm = 24.0;  // t_r at 1.9 g/cm3 [A]
  double wear = 1.0;                // 1 sharp
};
// (7.9), -t_r V + t_s N / |N|, against a feed along the surface's normal N. The gradient of the density gives the
// normal. Inside even bone it vanishes; then the feed direction is used [A], so that the spring is felt there too.
[[nodiscard]] double spring_damper_thrust_n(const SpringDamperParams& params, double feed_mm_per_s,
                                            double density_g_cm3) noexcept;

struct MultiPointParams {
  double stiffness = 17.7;  // K_1, N·s/mm per g/cm3 [A]
  double wear = 1.0;        // 1 sharp
};
// (7.14), the sum of (7.12) over the points, along the feed and solved for it: v = F / (K_1 sum K_2 D max(0,
// -n·direction)), with each point's inward normal n, density D and share K_2 of the active area. As printed, (7.12)
// also pushes during retraction, because it uses only the magnitude of the speed. Here a point counts if it moves into
// bone, -n·v > 0. `directed_density`: the sum.
[[nodiscard]] double multi_point_feed_mm_per_s(const MultiPointParams& params, double force_n,
                                               double directed_density) noexcept;

}  // namespace osteon
