// From a CT scan to a case: segmentation, resampling, surface and density.
#pragma once
#include <optional>
#include <string>

#include "common/imaging/calibration.hpp"
#include "common/volume/case.hpp"
#include "common/volume/iso_surface.hpp"
#include "server/import/ct_scan.hpp"

namespace osteon::import {

struct CtOptions {
  std::optional<double> pitch_mm;  // absent: the scan's smallest spacing
  double threshold_hu = imaging::kBoneThreshold_hu;
  DensityCalibration calibration = imaging::kRho1995;
  std::string title = "CT";  // never taken from the scan, whose names may be a patient's
};

// Bone is the largest island at or above the threshold. Where the scan ends within bone, the bone ends with the last
// whole voxel. Errors: invalid_input (no bone, too many samples), cancelled, internal.
[[nodiscard]] Result<Case> import_ct(CtScan scan, const CtOptions& options, const KeepGoing& keep_going);

}  // namespace osteon::import
