// A CT scanner for objects of known shape: blurred, noisy, in thick, tilted or uneven slices, as DICOM files.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace osteon::import {

struct ScannerSettings {
  double pixel_mm = 0.7;
  std::vector<double> gaps_mm = {};        // between slices along their normal, the table's way
  double thickness_mm = 1.0;               // of a slice: HU are its mean
  double blur_mm = 0.4;                    // sigma of the scanner's point spread function, the same along all axes
  double noise_hu = 25.0;                  // standard deviation, independent for each voxel
  double tilt_degrees = 0.0;               // of the gantry, about x
  std::uint32_t seed = 1;                  // of the noise
  Vec3 centre_mm = Vec3::Zero();           // of the scan, LPS
  double width_mm = 0.0, height_mm = 0.0;  // of a slice
};

// The part of a step's height that its blurred edge has at a distance inside it: a Gaussian's integral.
[[nodiscard]] double blurred_step(double inside_mm, double sigma_mm);

// HU at a point as the scanner's blur shows them, without noise.
using BlurredHu = std::function<double(const Vec3& at_mm)>;

// Writes the slices as a DICOM series into a new folder. Equal settings give equal voxels. Errors: exists, internal
// (disk), cancelled.
[[nodiscard]] Result<void> write_simulated_scan(const ScannerSettings& settings, const BlurredHu& hu,
                                                const std::filesystem::path& folder, const KeepGoing& keep_going);

}  // namespace osteon::import
