// The slices of a scan as PNG files: its grey values, or its edges.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

#include "common/core/keep_going.hpp"
#include "common/imaging/edges.hpp"
#include "common/imaging/smoothing.hpp"
#include "common/imaging/window_level.hpp"

namespace osteon::import {

enum class SliceContent { grey, gradient, canny };

struct SliceOptions {
  // As for a case: outliers are taken out by a median, then noise by a Gaussian.
  std::optional<imaging::MedianBox> median;
  double gaussian_mm = 0.0;  // its sigma; 0: none
  SliceContent content = SliceContent::grey;
  imaging::Window window;      // of grey slices
  imaging::CannyParams edges;  // sigma and space are those of the gradient too, which is white from the high limit on
};

// Makes the folder, which must not exist, with one file for each slice, slice-0001.png first. A file has a pixel for
// each voxel, its first row at the top. If anything fails, removes what was written. Errors: exists, internal (disk),
// exhausted (memory), cancelled.
[[nodiscard]] Result<void> write_slice_images(imaging::HuVolume volume, const std::filesystem::path& folder,
                                              const SliceOptions& options, const KeepGoing& keep_going);

// One slice, row by row. Error: internal (disk).
[[nodiscard]] Result<void> write_slice_image(std::span<const std::int16_t> hu, int columns,
                                             const imaging::Window& window, const std::filesystem::path& file);

}  // namespace osteon::import
