// The surface of labelled bone: smooth, and around as much volume as the labels have.
#pragma once
#include <array>

#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"
#include "common/volume/dense_volume.hpp"
#include "common/volume/sparse_volume.hpp"

namespace osteon::import {

// A field that is above 0 in the voxels of `bones` that are not 0 and below elsewhere. Both have the same voxels.
struct LabelField {
  imaging::HuVolume field;
  imaging::SparseMask bones;
};

// The field as imaging::smooth_labels() makes it, over the scan's voxels from `first` to `last` and a few around them.
// `grid`: where the voxels of `bones` lie. Error: cancelled.
[[nodiscard]] Result<LabelField> label_field(const imaging::SparseMask& bones, const imaging::HuVolume& grid,
                                             const std::array<int, 3>& first, const std::array<int, 3>& last,
                                             const KeepGoing& keep_going);

// Smoothing moves the surface of convex bone inwards by some hundredths of a voxel. This moves the whole surface back
// by one distance, so that the volume is again that of the labels: dV = A δ, with A from the samples within half a
// pitch of the surface.
void restore_volume(double labelled_mm3, double pitch_mm, DenseVolume<float>& surface_mm);
// The same for a narrow band over the samples of `box`, whose background is outside.
void restore_volume(double labelled_mm3, double pitch_mm, const CoordBox& box, SparseVolume& surface_mm);

}  // namespace osteon::import
