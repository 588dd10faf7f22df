// Common to all imports: a limit on samples.
#pragma once
#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::import {

// Samples of one import. At 8 bytes each, and with the sparse case, they stay within 20 GB.
inline constexpr double kLargestLattice = 1.0e9;
// Error: invalid_input, with the remedy.
[[nodiscard]] Result<void> check_lattice(const CoordBox& box, double pitch_mm);

}  // namespace osteon::import
