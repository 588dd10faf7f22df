// The density of a case for viewers, which have no bone.
#pragma once
#include "common/surface/density_grid.hpp"
#include "common/volume/case.hpp"

namespace osteon {

// Samples of level 0, or every 2nd, 4th … if there are more than kMostDensityLeaves. Any thread.
[[nodiscard]] DensityGrid density_of(const Case& bone);

}  // namespace osteon
