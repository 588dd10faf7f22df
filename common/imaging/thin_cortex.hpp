// Gives cortex that a scan blurs the thickness and the density that it has.
#pragma once
#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/point_spread.hpp"
#include "common/volume/case_description.hpp"
#include "common/volume/sparse_volume.hpp"

namespace osteon::imaging {

struct CortexCorrection {
  SparseVolume change_hu{0.0f};  // to be added to the HU of the samples
  PointSpread spread;
  double cortex_hu = 0.0;        // of compact cortex
  bool cortex_measured = false;  // where it is thick; or else kCortical_g_cm3 was assumed
  std::int64_t points = 0;       // of the surface that were looked at, about one for each sample beside it
  std::int64_t corrected = 0;    // of these; at the others the profile fits no cortex, and nothing changes
  double thickness_mm[3] = {};   // of cortex at corrected points: a tenth has less, half, and nine tenths
};

// At each point of the surface, a CortexProfile is fitted to the HU along the normal. The samples below the point then
// change by the difference between the profile without blur and with it. What the profile does not explain, such as the
// texture of cancellous bone, stays. Cortex begins at the surface, wherever the threshold has put that, so its mass for
// each area is kept. Bone so thin that both of its sides blur into one is a plate with cortex alone, at its own place.
// `surface_mm`: signed distances as narrow_band_mm() gives them for the scan. It fails where bones nearly touch, where
// cortex is porous, at edges sharper than the blur, and where metal is near: there the HU stay, or nearly so. Error:
// cancelled.
[[nodiscard]] Result<CortexCorrection> correct_thin_cortex(const HuVolume& volume, const SparseVolume& surface_mm,
                                                           double pitch_mm, const DensityCalibration& calibration,
                                                           const KeepGoing& keep_going);

}  // namespace osteon::imaging
