// Finds the line from a scan's Hounsfield units to density, in one of the ways that a user may choose.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/imaging/calibration.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/volume/case_description.hpp"

namespace osteon::import {

enum class RodMaterial {
  apparent,        // the density of the bone that looks like the rod: mass of wet bone over its whole volume
  hydroxyapatite,  // mineral
};

// At most one of `line` and `rods_g_cm3` may be given. None: the line of Rho 1995.
struct CalibrationOptions {
  std::optional<DensityCalibration> line;
  std::vector<double> rods_g_cm3;
  RodMaterial rods_of = RodMaterial::apparent;
  bool rescale_hu = false;  // first give air and soft tissue of the scan their usual HU; not with `line` or rods
};

struct ScanCalibration {
  DensityCalibration line = imaging::kRho1995;
  LabelProvenance provenance = {};  // with the standard errors of the line where they are known
  std::string text = {};            // what was found in the scan, as lines for a person
};

// Corrects the scan's HU too if the options say so. Errors: invalid_input (options that exclude each other, a line that
// falls, or no rods or tissue as the options say), cancelled.
[[nodiscard]] Result<ScanCalibration> calibrate_scan(imaging::HuVolume& scan, const CalibrationOptions& options,
                                                     const KeepGoing& keep_going);

// Names of parameters of the provenance: standard errors of the density of cancellous bone and of cortex, g/cm³.
inline constexpr const char* kCancellousError = "cancellous_error_g_cm3";
inline constexpr const char* kCorticalError = "cortical_error_g_cm3";

}  // namespace osteon::import
