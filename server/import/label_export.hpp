// Writes the labels of a case as a file that other programs read.
#pragma once
#include <filesystem>
#include <vector>

#include "common/volume/case_scan.hpp"

namespace osteon::import {

// The name's ending decides: NIfTI (.nii, .nii.gz), a segmentation of 3D Slicer (.seg.nrrd), or NRRD (.nrrd). Error:
// invalid_input, with the endings.
[[nodiscard]] Result<void> check_label_file(const std::filesystem::path& file);

// Writes the grid "labels" of the scan, voxel for voxel, as bytes. A .seg.nrrd names the labels too. The file is
// written completely or not at all. Errors: invalid_input (no labels, axes not at right angles, another ending),
// internal (disk), cancelled.
[[nodiscard]] Result<void> write_labels(const CaseScan& scan, const std::vector<CaseLabel>& labels,
                                        const std::filesystem::path& file, const KeepGoing& keep_going);

}  // namespace osteon::import
