// Edges of a CT volume: where its HU change most.
#pragma once
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

enum class EdgeSpace { slice, volume };  // each slice for itself, or all three axes

struct GradientParams {
  double sigma_mm = 0.0;  // of the Gaussian that smooths the scan first; 0: none
  EdgeSpace space = EdgeSpace::volume;
};

// Magnitude of the gradient, HU/mm, of each voxel in the volume's order. Central differences by the spacing of each
// axis; one-sided at the edge of the volume, 0 along an axis of one voxel. A smoothed scan has whole HU, so each
// component may be off by half a HU over the spacing. Error: cancelled.
[[nodiscard]] Result<std::vector<float>> gradient_magnitude(HuVolume volume, const GradientParams& params,
                                                            const KeepGoing& keep_going);

struct CannyParams {
  double sigma_mm = 1.0;  // as above
  double low_hu_per_mm = 100.0, high_hu_per_mm = 300.0;
  EdgeSpace space = EdgeSpace::volume;
};

// Edges after Canny 1986: 1 for every voxel whose gradient is at least `low_hu_per_mm`, is the largest along its own
// direction, and is connected to one of at least `high_hu_per_mm`, through faces, edges or corners. Of two equal
// voxels that follow each other the brighter side is the edge. `low_hu_per_mm`: above 0, at most `high_hu_per_mm`.
// Error: cancelled.
[[nodiscard]] Result<VoxelMask> canny_edges(HuVolume volume, const CannyParams& params, const KeepGoing& keep_going);

}  // namespace osteon::imaging
