// The correction of thin cortex as a part of an import.
#pragma once
#include <string>

#include "common/imaging/hu_volume.hpp"
#include "common/volume/sparse_volume.hpp"
#include "server/import/scan_calibration.hpp"

namespace osteon::import {

// What is to be added to the HU of the samples, see imaging::correct_thin_cortex(). Writes what was measured into the
// provenance and the text of the calibration. Error: cancelled.
[[nodiscard]] Result<SparseVolume> correct_cortex(const imaging::HuVolume& volume, const SparseVolume& surface_mm,
                                                  double pitch_mm, ScanCalibration& calibration,
                                                  const KeepGoing& keep_going);

}  // namespace osteon::import
