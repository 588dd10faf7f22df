// Finds tissue that is denser than compact bone: metal and enamel.
#pragma once
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"
#include "common/volume/case.hpp"

namespace osteon::imaging {

struct HardTissue {
  VoxelMask tissue;        // values of Tissue: metal, enamel, or none; empty dims if the scan has neither
  double metal_cm3 = 0.0;  // of voxels, within `bones`
  double enamel_cm3 = 0.0;
};

// Voxels from `metal_hu` on are metal. Voxels that the calibration shows as denser than kCompactBone_g_cm3 are metal
// too within two voxels of metal, because the scanner has blurred its edge. The rest of these is enamel, or mineral of
// the same density. Errors: cancelled.
[[nodiscard]] Result<HardTissue> find_hard_tissue(const HuVolume& volume, const SparseMask& bones,
                                                  const DensityCalibration& calibration, double metal_hu,
                                                  const KeepGoing& keep_going);

}  // namespace osteon::imaging
