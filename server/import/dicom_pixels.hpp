// Reads the pixels of one CT slice.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "common/core/result.hpp"
#include "server/import/dicom_header.hpp"

namespace osteon::import {

// Hounsfield units, row by row, into `out`, which has one for each pixel of the header. `name`: of the file, for
// people. The library may abort on a damaged file: call it in a process that may die. Error: invalid_input (no pixels,
// cut off, of another size, not to be decompressed).
[[nodiscard]] Result<void> read_pixels(const DicomHeader& h, const std::filesystem::path& file, const std::string& name,
                                       std::span<std::int16_t> out);

}  // namespace osteon::import
