// Reads the CT volume of an InVesalius 3 project (.inv3).
#pragma once
#include <filesystem>

#include "common/volume/iso_surface.hpp"
#include "server/import/ct_scan.hpp"

namespace osteon::import {

// A project is a gzip-compressed tar with main.plist (shape, spacing) and matrix.dat (int16 HU; columns fastest, then
// rows, slices). It stores no position, so the corner voxel with the smallest x, y and z becomes the origin of LPS.
// Columns go to the patient's left and slices to the head, as in the DICOM files that InVesalius sorted. Rows go to the
// front, opposite to DICOM's: InVesalius reads slices through VTK, whose first row is the lowest of the picture. The
// example skull confirms this: its vault lies at high slices, its nose and teeth at high rows.
// Errors: not_found, invalid_input (no archive, truncated, no plist, ...), unsupported (not CT, not axial), cancelled.
[[nodiscard]] Result<CtScan> read_inv3(const std::filesystem::path& file, const KeepGoing& keep_going);

}  // namespace osteon::import
