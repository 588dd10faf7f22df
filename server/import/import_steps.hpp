// What all imports have in common: a limit on samples.
#pragma once
#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::import {

// Samples of one import: 8 bytes each, and the sparse case besides, stay within 20 GB.
inline constexpr double kLargestLattice = 1.0e9;
// Error: invalid_input, with the remedy.
[[nodiscard]] Result<void> check_lattice(const CoordBox& box, double pitch_mm);

}  // namespace osteon::import
