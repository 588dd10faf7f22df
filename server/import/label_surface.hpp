// The surface of labelled bone: smooth, and around as much volume as the labels have.
#pragma once
#include <array>

#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"
#include "common/volume/dense_volume.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::import {

// A field over the scan's voxels from `first` to `last` and a few around them, which is above 0 in the voxels of
// `bones` that are not 0 and below elsewhere, as imaging::smooth_labels() makes it. `grid`: where the voxels of `bones`
// lie. Error: cancelled.
[[nodiscard]] Result<imaging::HuVolume> label_field(const imaging::VoxelMask& bones, const imaging::HuVolume& grid,
                                                    const std::array<int, 3>& first, const std::array<int, 3>& last,
                                                    const KeepGoing& keep_going);

// Smoothing moves the surface of convex bone inwards by some hundredths of a voxel. This moves the whole surface back
// by one distance, so that the volume is again that of the labels: dV = A δ, with A from the samples within half a
// pitch of the surface.
void restore_volume(double labelled_mm3, double pitch_mm, DenseVolume<float>& surface_mm);

}  // namespace osteon::import
