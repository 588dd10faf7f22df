// Writes voxels as an uncompressed NRRD file, for a program that shows them at once.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>

#include "common/core/keep_going.hpp"
#include "common/imaging/hu_volume.hpp"

namespace osteon::import {

// `grid`: where the voxels lie; its own values do not matter. Columns fastest. The file is written completely or not at
// all. Errors: invalid_input (another ending than .nrrd), internal (disk), cancelled.
[[nodiscard]] Result<void> write_raw_nrrd(const imaging::HuVolume& grid, std::span<const std::int16_t> hu,
                                          const std::filesystem::path& file, const KeepGoing& keep_going);
[[nodiscard]] Result<void> write_raw_nrrd(const imaging::HuVolume& grid, std::span<const std::uint8_t> labels,
                                          const std::filesystem::path& file, const KeepGoing& keep_going);

}  // namespace osteon::import
