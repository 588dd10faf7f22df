// NIfTI, NRRD and MetaImage files, as ITK reads them. ITK may abort on a damaged file, so call the readers in a process
// that may die. Its headers stay in the source file: they bring an Eigen of their own.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "common/core/result.hpp"
#include "server/import/volume_format.hpp"

namespace osteon::import {

struct VolumeHeader {
  std::array<std::uint64_t, 3> dims{};          // columns, rows, slices
  std::array<double, 3> spacing_mm{};           // between neighbours along each
  std::array<double, 3> origin_mm{};            // centre of the first voxel, LPS
  std::array<std::array<double, 3>, 3> axes{};  // directions of columns, rows and slices, LPS
  std::uint64_t voxel_bytes = 0;                // of one voxel, uncompressed
};

// Errors: invalid_input (damaged, one slice), unsupported (several volumes, colours, vectors).
[[nodiscard]] Result<VolumeHeader> read_volume_header(const std::filesystem::path& file, VolumeFormat format);

// Calls `on_slice` with each slice: whole HU, columns fastest. Fractions are rounded, what exceeds int16 is clamped,
// and voxels without a number are air (-1024 HU). In NIfTI these, and infinite ones, are 0 HU: its library replaces
// them. Errors: invalid_input (truncated, damaged), unsupported.
[[nodiscard]] Result<void> read_volume_slices(const std::filesystem::path& file, VolumeFormat format,
                                              const std::function<void(std::span<const std::int16_t>)>& on_slice);

}  // namespace osteon::import
