// Reads a CT series, one DICOM file for each slice, from a folder.
#pragma once
#include <filesystem>

#include "common/volume/iso_surface.hpp"
#include "server/import/ct_scan.hpp"

namespace osteon::import {

// Slices are ordered by their position along the normal of their plane, never by file name or number. Files that are
// not DICOM and scout images (LOCALIZER) are passed over. Everything that would make the volume's shape or its values
// doubtful is refused: several series, another modality than CT, several frames in a file, slices of different size,
// a tilted gantry, uneven gaps, missing spacing, position, rescaling or pixels, retired compressions.
// Errors: not_found, invalid_input, unsupported, cancelled.
[[nodiscard]] Result<CtScan> read_dicom_series(const std::filesystem::path& folder, const KeepGoing& keep_going);

}  // namespace osteon::import
