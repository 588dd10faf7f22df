// Writes a volume as a DICOM CT series, one file for each slice.
#pragma once
#include <filesystem>

#include "common/core/result.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/volume/iso_surface.hpp"

namespace gdcm {
class Writer;
}

namespace osteon::import {

// Writes what the writer holds, completely or not at all. GDCM itself may abort where a disk is full. Error: internal.
[[nodiscard]] Result<void> write_dicom(gdcm::Writer& writer, const std::filesystem::path& file);

// Makes the folder, which must not exist, and fills it. If anything fails, removes what was written.
// Errors: exists, internal (disk), cancelled.
[[nodiscard]] Result<void> write_dicom_series(const imaging::HuVolume& volume, const std::filesystem::path& folder,
                                              const KeepGoing& keep_going);

}  // namespace osteon::import
