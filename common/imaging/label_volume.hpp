// A segmented volume with a label for each voxel, and a smooth surface through its steps.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/lattice.hpp"
#include "common/volume/dense_volume.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::imaging {

// Voxel (i, j, k) has its centre at (i, j, k) · spacing. Samples in `labels.box` count voxels.
struct LabelVolume {
  std::array<int, 3> dims{};  // columns, rows, slices
  Vec3 spacing_mm = Vec3::Ones();
  DenseVolume<std::uint8_t> labels;  // 0: not bone; otherwise the kind of bone, from 1
};

struct SmoothingParams {
  int rounds = 8;       // each round blurs with [1 2 1]/4 along every axis, and reverses most of the shrinking
  float least = 0.05f;  // smallest distance of each voxel's value from zero, on its own side
};

// A field whose zero is the bone's surface: about 1 deep in bone, -1 far from it, on the labels' box. A low-pass filter
// without shrinkage removes the steps of binary voxels: a blur u <- Bu followed by its counterpart u <- u + μ(u - Bu)
// (Taubin 1995, here for a field). Every voxel is kept on its side of zero, so that thin walls and small cells stay
// (compare Whitaker 2000). The filter cannot remove steps that are farther apart than its reach of some 8 voxels. Such
// a terrace stays, with a rounded edge. Error: cancelled.
[[nodiscard]] Result<DenseVolume<float>> smooth_labels(const LabelVolume& volume, const SmoothingParams& params,
                                                       const KeepGoing& keep_going);

// Trilinear samples of a field on voxels of `spacing_mm`, on a lattice of `pitch_mm` over `box`. Outside its box the
// field continues with its values at the edge. Error: cancelled.
[[nodiscard]] Result<DenseVolume<float>> resample(const DenseVolume<float>& field, const Vec3& spacing_mm,
                                                  const CoordBox& box, double pitch_mm, const KeepGoing& keep_going);

// The density of the nearest voxel's label, on a lattice. Within two voxels of bone, the largest label there counts, so
// that the density does not decrease towards the surface. `density_g_cm3`: of labels 0, 1, 2, …
[[nodiscard]] Result<DenseVolume<float>> label_density(const LabelVolume& volume, std::span<const float> density_g_cm3,
                                                       const CoordBox& box, double pitch_mm,
                                                       const KeepGoing& keep_going);

// The box of the bone voxels, both ends included. Empty if there are none.
[[nodiscard]] CoordBox bone_voxels(const LabelVolume& volume);

}  // namespace osteon::imaging
