// Broaching by blows [A]. A mallet of mass m with the impulse J has the energy J^2/(2m). The broach loses a part in
// bouncing; the rest crushes the bone at its teeth. So a blow advances it by efficiency · J^2 / (2 m R), with the
// resistance R = ultimate stress · engaged area projected on the advance. If that is less than the smallest visible
// advance of a blow, the broach is seated: it rings and stays.
#pragma once
#include "common/core/units.hpp"
#include "common/mechanics/feed_law.hpp"

namespace osteon {

struct BroachingParams {
  double impulse_n_s = 2.8;     // of a blow: 0.7 kg at 4 m/s [A]
  double mallet_kg = 0.7;       // [A]
  double efficiency = 0.7;      // [A]
  double crushing_mpa = 130.0;  // ultimate stress at 1.9 g/cm3 [A]
  double seated_mm = 0.1;       // smallest advance of a blow [A]
  double most_mm = 5.0;         // largest advance, with almost no resistance [A]
  double hold_n = 5.0;          // force of the user's hand at which blows count fully [A]
  double wear = 1.0;            // 1 sharp
};

// Resistance against being driven in, N.
[[nodiscard]] Newtons broaching_resistance(const BroachingParams& params, double engaged_area_mm2,
                                           GramsPerCm3 density) noexcept;
// Advance of one blow, mm. Zero if the broach is seated.
[[nodiscard]] double blow_advance_mm(const BroachingParams& params, double engaged_area_mm2,
                                     GramsPerCm3 density) noexcept;
// Resistance over that at which the broach is seated, 0 to 1. The advance of a blow is seated_mm over it.
[[nodiscard]] double seating(const BroachingParams& params, double engaged_area_mm2, GramsPerCm3 density) noexcept;
// Blows per minute as a feed law. The feed is at most what the blows produce, and reaches that if the broach is held
// firmly.
[[nodiscard]] FeedLaw broaching_law(const BroachingParams& params, RevolutionsPerMinute blows, double engaged_area_mm2,
                                    GramsPerCm3 density) noexcept;

}  // namespace osteon
