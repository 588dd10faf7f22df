// A case of a phantom bone, with the exact truth as its scan.
#pragma once
#include <string>
#include <utility>

#include "common/core/keep_going.hpp"
#include "common/phantoms/phantom_bone.hpp"
#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"

namespace osteon::phantoms {

struct PhantomCaseOptions {
  double pitch_mm = 0.5;
  std::string title = "Phantom";
  DensityCalibration calibration = {};             // from HU to density, for the HU of the scan
  std::pair<double, double> hu = {-1000.0, 40.0};  // of air, the least, and of the soft tissue around the bone
};

struct PhantomCase {
  Case bone;
  CaseScan scan;  // HU, labels and tissues without blur or noise, on voxels of the pitch
};

// The surface is the Euclidean distance to the bone's zero. The density of a sample is its mean over a pitch of depth.
// Labels are "cortical", "cancellous" and "marrow", after the bone's name if there are several, and then one for each
// structure; those without a voxel are left out. Structures are in the scan only, not in what is cut. Landmarks, axes
// and planes are those of the bone, and the provenance of the first label has its parameters. Errors: invalid_input (a
// pitch that is too coarse for the cortex or too fine for the memory), cancelled, internal.
[[nodiscard]] Result<PhantomCase> build_phantom_case(const PhantomBone& bone, const PhantomCaseOptions& options,
                                                     const KeepGoing& keep_going);

}  // namespace osteon::phantoms
