// Finds the rods of a calibration phantom: uniform cylinders of known density that lie along the scan's slices.
#pragma once
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/imaging/calibration_line.hpp"
#include "common/imaging/hu_volume.hpp"

namespace osteon::imaging {

struct CalibrationRod {
  DensityReading reading;     // its density as given, and the mean of its HU
  double deviation_hu = 0.0;  // of its voxels: the scan's noise
  Vec3 centre_mm = Vec3::Zero();
  double diameter_mm = 0.0;  // of the part that was read, which leaves out the blurred edge
  double length_mm = 0.0;
};

// A rod is a disc of 4 to 40 mm in every slice of at least half of the scan. It has about the same place, size and HU
// in all of them, and another HU than what is around it. Of more discs than rods, those are taken whose HU lie best on
// a line over the densities, which are equally wide and lie in one row. So a round vessel or marrow space beside the
// rods is left out. `densities_g_cm3`: two to eight, in any order. Errors: invalid_input (densities that are no such
// list, or fewer rods than that), cancelled.
[[nodiscard]] Result<std::vector<CalibrationRod>> find_rods(const HuVolume& volume,
                                                            std::span<const double> densities_g_cm3,
                                                            const KeepGoing& keep_going);

}  // namespace osteon::imaging
