// What is denser in a scan than compact bone can be: metal and enamel.
#pragma once
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"
#include "common/volume/case.hpp"

namespace osteon::imaging {

struct HardTissue {
  VoxelMask tissue;        // values of Tissue: metal, enamel, or none; empty dims where the scan has neither
  double metal_cm3 = 0.0;  // of voxels, within `bones`
  double enamel_cm3 = 0.0;
};

// Voxels that the calibration takes for denser than kCompactBone_g_cm3. Those from kMetal_hu on are metal, and so are
// denser ones within two voxels of it, where the scanner has blurred its edge. The others are enamel, or mineral as
// dense. Errors: cancelled.
[[nodiscard]] Result<HardTissue> find_hard_tissue(const HuVolume& volume, const VoxelMask& bones,
                                                  const DensityCalibration& calibration, const KeepGoing& keep_going);

}  // namespace osteon::imaging
