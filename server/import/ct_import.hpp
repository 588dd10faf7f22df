// From a CT scan to a case: segmentation, resampling, surface and density.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/imaging/calibration.hpp"
#include "common/imaging/islands.hpp"
#include "common/volume/case.hpp"
#include "common/volume/iso_surface.hpp"
#include "server/import/ct_scan.hpp"

namespace osteon::import {

struct CtOptions {
  std::optional<double> pitch_mm;  // absent: the scan's smallest spacing
  double threshold_hu = imaging::kBoneThreshold_hu;
  DensityCalibration calibration = imaging::kRho1995;
  std::string title = "CT";  // never taken from the scan, whose names may be a patient's
  std::vector<int> keep;     // islands by number, from 1; empty: the largest
  bool keep_all = false;
  bool merge = false;      // the kept islands count as one bone
  bool hollow = false;     // what bone encloses is not bone
  bool list_only = false;  // find the islands and make no case
};

// What the segmentation found.
struct CtSegmentation {
  std::vector<imaging::Island> islands;  // largest first; number N is islands[N - 1]
  std::vector<int> kept;                 // numbers; empty where the islands were only listed
  bool merged = false;                   // the kept ones are one bone
  double left_out_cm3 = 0.0;             // of the islands that were not kept
  double marrow_cm3 = 0.0;               // below the threshold, within what was kept
  std::vector<double> joined_cm3;        // large pieces of dense and cancellous bone that only marrow joins, if several
  double case_cm3 = 0.0;                 // of the case's bone
  double metal_cm3 = 0.0, enamel_cm3 = 0.0;  // within what was kept
  Box region;                                // of the scan around all that reaches the threshold, LPS
};

struct CtImport {
  CtSegmentation found;
  std::optional<Case> bone;  // empty only where the islands were only listed
};

// Bone is what segment_bone() says, of the islands that the options keep. Where the scan ends within bone, the bone
// ends with the last whole voxel. No density is above that of compact bone; what the scan shows above it is labelled
// metal or enamel. Errors: invalid_input (no bone, no such island, voxels of an impossible size, too many samples),
// exhausted (memory), cancelled, internal.
[[nodiscard]] Result<CtImport> import_ct(CtScan scan, const CtOptions& options, const KeepGoing& keep_going);

// The islands, what was left out, and metal, as lines for a person.
[[nodiscard]] std::string segmentation_text(const CtSegmentation& found);

}  // namespace osteon::import
