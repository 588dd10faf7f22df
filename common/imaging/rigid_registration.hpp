// Rigid registration of two scans by the mutual information of their values.
#pragma once
#include <cstddef>
#include <span>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/hu_volume.hpp"

namespace osteon::imaging {

// Part of the smaller scan that both cover, below which they are not registered.
inline constexpr double kLeastOverlap = 0.05;

struct RigidRegistration {
  Pose pose_fixed_moving;  // the moving scan seen from the fixed one
  std::size_t start = 0;   // that was refined
  // Mutual information in nats at the same points of the fixed scan, as far as the scans overlap.
  double information_at_start = 0.0, information = 0.0;
  double overlap_at_start = 0.0, overlap = 0.0;  // part of the smaller scan that both cover
  bool refined = true;                           // false: nothing better was found, and the pose is that of the start
};

// Part of the smaller scan that both cover, measured at a lattice of points of the fixed one.
[[nodiscard]] double overlap_of(const HuVolume& fixed, const HuVolume& moving, const Pose& pose_fixed_moving);

// Refines a start with the mutual information of Mattes 2003 (ITK), from coarse voxels to fine ones. Of several starts,
// each is refined on the coarsest voxels, and the one with the most information goes on; of equal ones the first.
// It uses neither HU nor their order: one scan may be of another kind than the other. The search has at most 200
// iterations on each of at most four sizes of voxels, on one thread and at fixed points: equal scans give equal poses.
// It finds a turn of up to about 20 degrees and a shift of up to a quarter of the scan; a far start may end elsewhere.
// Errors: invalid_input (no start with enough overlap, a scan of one value), exhausted (memory), cancelled, internal.
[[nodiscard]] Result<RigidRegistration> register_rigidly(const HuVolume& fixed, const HuVolume& moving,
                                                         std::span<const Pose> starts, const KeepGoing& keep_going);

}  // namespace osteon::imaging
