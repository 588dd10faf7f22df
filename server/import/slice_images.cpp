#include "server/import/slice_images.hpp"

#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/new_folder.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr double kSmoothedEnd = 0.3, kEdgesEnd = 0.8;  // fractions of the time
constexpr std::uint8_t kWhite = 255;

// One byte for each voxel. Errors: cancelled.
Result<std::vector<std::uint8_t>> greys(imaging::HuVolume volume, const SliceOptions& options,
                                        const KeepGoing& keep_going) {
  std::vector<std::uint8_t> out;
  if (options.content == SliceContent::canny) {
    auto edges = imaging::canny_edges(std::move(volume), options.edges, keep_going);
    if (!edges) return tl::unexpected(edges.error());
    for (std::uint8_t& value : edges->values) value = value != 0 ? kWhite : 0;
    return std::move(edges->values);
  }
  if (options.content == SliceContent::gradient) {
    const auto gradient =
        imaging::gradient_magnitude(std::move(volume), {options.edges.sigma_mm, options.edges.space}, keep_going);
    if (!gradient) return tl::unexpected(gradient.error());
    const auto white = static_cast<float>(options.edges.high_hu_per_mm);
    for (const float value : *gradient)
      out.push_back(static_cast<std::uint8_t>(std::lround(kWhite * std::min(value / white, 1.0f))));
    return out;
  }
  for (const std::int16_t hu : volume.values) out.push_back(imaging::grey_of(hu, options.window));
  return out;
}

Result<void> write_png(const fs::path& file, int columns, int rows, const std::uint8_t* pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(columns);
  image.height = static_cast<png_uint_32>(rows);
  image.format = PNG_FORMAT_GRAY;
  if (png_image_write_to_file(&image, file.c_str(), 0, pixels, 0, nullptr) != 0) return {};
  return failure(ErrorCode::internal, "cannot write " + file.string() + ": " + image.message + "; is the disk full?");
}

Result<void> write_slices(imaging::HuVolume volume, const fs::path& folder, const SliceOptions& options,
                          const KeepGoing& keep_going) try {
  if (options.median)
    if (auto done = smooth_median(volume, *options.median, part(keep_going, 0.0, 0.5 * kSmoothedEnd)); !done)
      return done;
  if (options.gaussian_mm > 0.0)
    if (auto done = smooth_gaussian(volume, options.gaussian_mm, part(keep_going, 0.5 * kSmoothedEnd, kSmoothedEnd));
        !done)
      return done;
  const std::array<int, 3> dims = volume.dims;
  const auto pixels = greys(std::move(volume), options, part(keep_going, kSmoothedEnd, kEdgesEnd));
  if (!pixels) return tl::unexpected(pixels.error());
  const std::size_t area = static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]);
  for (int slice = 0; slice < dims[2]; ++slice) {
    if (!keep_going(kEdgesEnd + (1.0 - kEdgesEnd) * slice / dims[2]))
      return stopped_while("writing " + folder.string());
    char name[32];
    std::snprintf(name, sizeof name, "slice-%04d.png", slice + 1);
    if (auto written =
            write_png(folder / name, dims[0], dims[1], pixels->data() + static_cast<std::size_t>(slice) * area);
        !written)
      return written;
  }
  return {};
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted,
                 "this machine has no memory for a scan of that size; export thicker slices or a smaller region");
}

}  // namespace

Result<void> write_slice_images(imaging::HuVolume volume, const fs::path& folder, const SliceOptions& options,
                                const KeepGoing& keep_going) {
  return write_new_folder(
      folder, [&](const fs::path& partial) { return write_slices(std::move(volume), partial, options, keep_going); });
}

Result<void> write_slice_image(std::span<const std::int16_t> hu, int columns, const imaging::Window& window,
                               const fs::path& file) {
  std::vector<std::uint8_t> pixels;
  pixels.reserve(hu.size());
  for (const std::int16_t value : hu) pixels.push_back(imaging::grey_of(value, window));
  return write_png(file, columns, static_cast<int>(hu.size()) / columns, pixels.data());
}

}  // namespace osteon::import
