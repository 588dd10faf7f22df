// Envelopes of a partial as line segments (Serra 1990): few knots instead of a point for each frame.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/sound/partials.hpp"

namespace osteon::sound {

// A corner of both envelopes. Between two knots frequency (Hz) and level (dB) are lines over time.
struct Knot {
  std::size_t frame = 0;
  double hz = 0;
  double level_db = 0;  // of the amplitude, dB re 1
};

struct SegmentTolerance {
  double level_db = 1.5;
  double hz = 3.0;
  double part = 0.002;  // of the frequency; the larger of both counts
};

// Knots such that no point of the partial is farther from the lines than the tolerance (Ramer 1972). The first and the
// last point are knots.
[[nodiscard]] std::vector<Knot> knots_of(const Partial& partial, const SegmentTolerance& tolerance = {});

// A point for each frame from the first knot to the last. Phases are 0. `knots`: frames rising.
[[nodiscard]] Partial partial_of(std::span<const Knot> knots);

}  // namespace osteon::sound
