// How much a scan blurs, measured at its own edges.
#pragma once
#include <array>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/hu_volume.hpp"

namespace osteon::imaging {

// A Gaussian, as a point becomes after trilinear interpolation between voxels.
struct PointSpread {
  Vec3 sigma_mm = Vec3::Zero();    // along columns, rows and slices
  std::array<bool, 3> measured{};  // false: no edge shows it, so half of the voxel's edge is assumed
  int edges = 0;                   // that were measured

  // Along a direction in voxel axes (a unit vector).
  [[nodiscard]] double along_mm(const Vec3& direction) const { return sigma_mm.cwiseProduct(direction).norm(); }
};

// Measured at edges of one step between two plateaus, mostly skin against air and thick cortex. The sigma of an edge
// along its normal n is √(Σ n² sigma²). Edges that differ much from the others are left out. Error: cancelled.
[[nodiscard]] Result<PointSpread> measure_point_spread(const HuVolume& volume, const KeepGoing& keep_going);

}  // namespace osteon::imaging
