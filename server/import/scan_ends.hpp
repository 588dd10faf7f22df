// Ends the bone where its scan ends.
#pragma once
#include <span>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/volume/sparse_volume.hpp"

namespace osteon::import {

// The intersection of two solids is the maximum of their distances, here of a bone and of the block that was scanned.
// `surface_mm`: of the samples of `part`, z fastest, at most `band_mm`, which stays.
void cap_at_scan(const imaging::HuVolume& scan, const CoordBox& part, double pitch_mm, float band_mm,
                 std::span<float> surface_mm);
// The same for all samples of a narrow band, whose background is outside. Error: cancelled.
[[nodiscard]] Result<void> cap_at_scan(const imaging::HuVolume& scan, double pitch_mm, SparseVolume& surface_mm,
                                       const KeepGoing& keep_going);

}  // namespace osteon::import
