// Reads the pixels of one CT slice.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "common/core/result.hpp"
#include "server/import/dicom_header.hpp"

namespace osteon::import {

// Writes Hounsfield units, row by row, into `out`, which has one value for each pixel of the header. `name`: name of
// the file, for people. The library may abort on a damaged file, so call this in a process that may die. Error:
// invalid_input (no pixels, truncated, of another size, cannot be decompressed).
[[nodiscard]] Result<void> read_pixels(const DicomHeader& h, const std::filesystem::path& file, const std::string& name,
                                       std::span<std::int16_t> out);

}  // namespace osteon::import
