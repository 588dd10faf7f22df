// Which of NIfTI, NRRD and MetaImage a file is, and whether all its voxels are there. The libraries of these formats
// take a file that ends within its voxels for a whole one, and the rest for zeros.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "common/core/result.hpp"

namespace osteon::import {

enum class VolumeFormat { none, nifti, nrrd, meta_image };

// By the first bytes, also of a compressed file.
[[nodiscard]] VolumeFormat volume_format(const std::filesystem::path& file);
[[nodiscard]] std::string_view name_of(VolumeFormat format);

// ITK needs the ending of the format. Errors: invalid_input (another ending), unsupported (NIfTI-2).
[[nodiscard]] Result<void> check_kind(const std::filesystem::path& file, VolumeFormat format);

// The first bytes of a file, unpacked if it is compressed; all of a shorter one.
[[nodiscard]] std::string unpacked_head(const std::filesystem::path& file, std::size_t bytes);

// False if nothing in the file says how the volume lies in the patient. Then left and right are a guess.
[[nodiscard]] bool says_orientation(const std::filesystem::path& file, VolumeFormat format);

// `voxels`: their number; `voxel_bytes`: of one, uncompressed. The voxels may be in another file, which the header
// names. Errors: invalid_input (they end early), not_found (the other file), unsupported (several files).
[[nodiscard]] Result<void> check_voxels(const std::filesystem::path& file, VolumeFormat format, std::uint64_t voxels,
                                        std::uint64_t voxel_bytes);

}  // namespace osteon::import
