// Computes the signed distance to the surface on which a sampled field crosses a value, with sub-voxel precision.
#pragma once
#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/volume/dense_volume.hpp"

namespace osteon {

// Inside is where field >= iso. Millimetres, negative inside, clipped to ±4 pitches. The crossing is interpolated
// linearly along lattice edges. So a plane is exact, and a sphere of radius r voxels is exact to about 0.7 / r voxel.
// Beyond its box, the field continues with its values at the box's edge. Equal input gives equal bytes for any number
// of threads. Errors: cancelled, internal.
[[nodiscard]] Result<DenseVolume<float>> signed_distance_mm(const DenseVolume<float>& field, float iso, double pitch_mm,
                                                            const KeepGoing& keep_going);

}  // namespace osteon
