// NIfTI, NRRD and MetaImage files, as ITK reads them. ITK may abort on a damaged file, so call the readers in a process
// that may die. Its headers stay in the source file: they bring an Eigen of their own.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "common/core/result.hpp"
#include "server/import/slicer_segments.hpp"
#include "server/import/volume_format.hpp"

namespace osteon::import {

// What the voxels of a file are.
enum class VoxelContent { hu, labels };

struct VolumeHeader {
  std::array<std::uint64_t, 3> dims{};          // columns, rows, slices
  std::array<double, 3> spacing_mm{};           // between neighbours along each
  std::array<double, 3> origin_mm{};            // centre of the first voxel, LPS
  std::array<std::array<double, 3>, 3> axes{};  // directions of columns, rows and slices, LPS
  std::uint64_t voxel_bytes = 0;                // of one voxel, with all layers, uncompressed
  std::uint64_t layers = 1;                     // numbers for each voxel; more than one only for labels in NRRD
};

// Errors: invalid_input (damaged, one slice), unsupported (several volumes, colours, vectors).
[[nodiscard]] Result<VolumeHeader> read_volume_header(const std::filesystem::path& file, VolumeFormat format,
                                                      VoxelContent content);

// The fields of an NRRD header whose keys begin with "Segment". Error: invalid_input (damaged).
[[nodiscard]] Result<HeaderFields> read_segment_fields(const std::filesystem::path& file);

// Takes a slice: whole HU, columns fastest, and how many of its voxels are NaN or infinite in the file.
using OnHuSlice = std::function<void(std::span<const std::int16_t> hu, std::uint32_t without_number)>;
// Calls `on_slice` with each slice. Fractions are rounded, what exceeds int16 is clamped, and voxels that are NaN or
// infinite have kPadding_hu. Errors: invalid_input (truncated, damaged), unsupported.
[[nodiscard]] Result<void> read_volume_slices(const std::filesystem::path& file, VolumeFormat format,
                                              const OnHuSlice& on_slice);

// The same for labels: whole numbers from 0 to 65535, layers fastest, then columns. Errors: those above, and
// invalid_input (another number; names it).
[[nodiscard]] Result<void> read_label_slices(const std::filesystem::path& file, VolumeFormat format,
                                             const std::function<void(std::span<const std::uint16_t>)>& on_slice);

// Writes labels, columns fastest, with the fields of `header` but its bytes and layers. `fields`: of an NRRD header.
// Errors: internal (disk).
[[nodiscard]] Result<void> write_label_volume(const std::filesystem::path& file, VolumeFormat format,
                                              const VolumeHeader& header, std::span<const std::uint8_t> labels,
                                              const HeaderFields& fields);

// Writes whole HU, or labels from 0 to 65535, in the same way.
[[nodiscard]] Result<void> write_hu_volume(const std::filesystem::path& file, VolumeFormat format,
                                           const VolumeHeader& header, std::span<const std::int16_t> hu);
[[nodiscard]] Result<void> write_label_volume(const std::filesystem::path& file, VolumeFormat format,
                                              const VolumeHeader& header, std::span<const std::uint16_t> labels);

}  // namespace osteon::import
