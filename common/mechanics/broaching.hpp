// Broaching by blows [A]: a mallet of mass m that brings the impulse J brings the energy J^2/(2m); what the broach does
// not give back in bouncing is spent against the bone that its teeth crush, so a blow advances it by
// efficiency · J^2 / (2 m R) with the resistance R = ultimate stress · engaged area projected on the advance. Where
// that is less than a blow can be seen to do, the broach is seated: it rings and stays.
#pragma once
#include "common/core/units.hpp"
#include "common/mechanics/feed_law.hpp"

namespace osteon {

struct BroachingParams {
  double impulse_n_s = 2.8;     // of a blow: 0.7 kg at 4 m/s [A]
  double mallet_kg = 0.7;       // [A]
  double efficiency = 0.7;      // [A]
  double crushing_mpa = 130.0;  // ultimate stress at 1.9 g/cm3 [A]
  double seated_mm = 0.1;       // least advance of a blow [A]
  double most_mm = 5.0;         // most, where next to nothing is in the way [A]
  double hold_n = 5.0;          // how firmly it is held for its blows to count in full [A]
  double wear = 1.0;            // 1 sharp
};

// Resistance against being driven, N.
[[nodiscard]] Newtons broaching_resistance(const BroachingParams& params, double engaged_area_mm2,
                                           GramsPerCm3 density) noexcept;
// Advance of one blow, mm; zero where it is seated.
[[nodiscard]] double blow_advance_mm(const BroachingParams& params, double engaged_area_mm2,
                                     GramsPerCm3 density) noexcept;
// Blows a minute as a feed: no faster than they drive it, and that fast where it is held firmly.
[[nodiscard]] FeedLaw broaching_law(const BroachingParams& params, RevolutionsPerMinute blows, double engaged_area_mm2,
                                    GramsPerCm3 density) noexcept;

}  // namespace osteon
