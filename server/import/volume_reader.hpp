// Reads the CT volume, or the labels, of one file: NIfTI, NRRD or MetaImage.
#pragma once
#include <filesystem>

#include "common/core/keep_going.hpp"
#include "server/import/ct_scan.hpp"
#include "server/import/label_map.hpp"

namespace osteon::import {

// Positions and directions become LPS, whatever the file uses. Values become whole HU: fractions are rounded, what
// exceeds int16 is clamped, and voxels without a number are air (-1024 HU; in NIfTI 0 HU). ITK reads the file in
// another process, because it may abort on a damaged file.
// Errors: not_found, invalid_input (truncated, damaged, name without the format's ending, axes not at right angles, one
// slice), unsupported (colours, vectors, time), exhausted (memory), cancelled, internal.
[[nodiscard]] Result<CtScan> read_volume(const std::filesystem::path& file, const KeepGoing& keep_going);

// The same for labels, as read_label_map() describes them, without names but for those of 3D Slicer's segmentations.
[[nodiscard]] Result<LabelMap> read_label_volume(const std::filesystem::path& file, const KeepGoing& keep_going);

}  // namespace osteon::import
