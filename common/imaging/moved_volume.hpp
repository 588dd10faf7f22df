// A scan or labels on the voxels of another scan, to which they were registered.
#pragma once
#include <cstdint>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/hu_volume.hpp"

namespace osteon::imaging {

inline constexpr std::int16_t kBeyondScan_hu = -1024;  // of voxels that the moving scan does not reach: air

// Whole HU of `moving`, trilinear, for the voxels of `fixed`. Values of `fixed` do not matter. Error: cancelled.
[[nodiscard]] Result<std::vector<std::int16_t>> moved_hu(const HuVolume& fixed, const HuVolume& moving,
                                                         const Pose& pose_fixed_moving, const KeepGoing& keep_going);

// The nearest label for each voxel of `fixed`, and 0 beyond `moving`, whose voxels `labels` lie on. Error: cancelled.
[[nodiscard]] Result<std::vector<std::uint16_t>> moved_labels(const HuVolume& fixed, const HuVolume& moving,
                                                              const std::vector<std::uint16_t>& labels,
                                                              const Pose& pose_fixed_moving,
                                                              const KeepGoing& keep_going);

}  // namespace osteon::imaging
