// Common to all imports: a limit on samples.
#pragma once
#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::import {

// Largest number of samples of one import. With 8 bytes for each, and the sparse case, they need at most 20 GB.
inline constexpr double kLargestLattice = 1.0e9;
// Error: invalid_input, with the remedy.
[[nodiscard]] Result<void> check_lattice(const CoordBox& box, double pitch_mm);

}  // namespace osteon::import
