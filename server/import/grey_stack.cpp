#include "server/import/grey_stack.hpp"

#include <png.h>

#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "server/import/numbered_files.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr double kMostSlicePixels = 6.4e7;  // a small file can claim far more, and all of them are decoded at once

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

using Message = std::array<char, 96>;

[[noreturn]] void leave(png_structp png, png_const_charp text) {
  auto* message = static_cast<Message*>(png_get_error_ptr(png));
  std::snprintf(message->data(), message->size(), "%s", text);
  std::longjmp(png_jmpbuf(png), 1);
}
void ignore(png_structp, png_const_charp) {}

// The library leaves these two by longjmp, so they make no objects.
bool read_head(png_structp png, png_infop info, std::FILE* file) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_init_io(png, file);
  png_read_info(png, info);
  return true;
}
bool read_rows(png_structp png, png_infop info, png_bytepp rows) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_packing(png);  // a byte for each pixel of less than 8 bits
  png_set_strip_alpha(png);
  if (std::endian::native == std::endian::little) png_set_swap(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  return true;
}

// A PNG file that is open while this object lives.
class GreyPng {
 public:
  explicit GreyPng(const fs::path& path) : path_(path), file_(std::fopen(path.c_str(), "rb")) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, &message_, leave, ignore);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
    if (info_ == nullptr) {
      png_destroy_read_struct(&png_, nullptr, nullptr);
      throw std::bad_alloc();
    }
  }
  ~GreyPng() { png_destroy_read_struct(&png_, &info_, nullptr); }
  GreyPng(const GreyPng&) = delete;
  GreyPng& operator=(const GreyPng&) = delete;

  Result<void> open() {
    if (!file_) return failure(ErrorCode::not_found, "cannot open " + path_.string() + "; check its permissions");
    if (!read_head(png_, info_, file_.get()))
      return bad_input(path_.string() + " cannot be read as a PNG picture (" + message_.data() + "); export it again");
    const int colour = png_get_color_type(png_, info_);
    if (colour != PNG_COLOR_TYPE_GRAY && colour != PNG_COLOR_TYPE_GRAY_ALPHA)
      return bad_input(path_.string() +
                       " is in colours; give slices of grey values, or slices whose colours name structures to "
                       "osteon-import labels");
    return {};
  }
  [[nodiscard]] std::uint32_t width() const { return png_get_image_width(png_, info_); }
  [[nodiscard]] std::uint32_t height() const { return png_get_image_height(png_, info_); }
  [[nodiscard]] int bits() const { return png_get_bit_depth(png_, info_); }

  // The grey values, row by row, after open().
  Result<std::vector<std::uint16_t>> pixels() {
    const std::size_t columns = width(), count = columns * height(), bytes = bits() == 16 ? 2 : 1;
    // Grey with transparency is read before the transparency is taken out, in the same memory.
    const std::size_t row_bytes = std::max<std::size_t>(png_get_rowbytes(png_, info_), columns * bytes);
    std::vector<png_byte> stored(row_bytes * height());
    std::vector<png_bytep> rows(height());
    for (std::size_t row = 0; row < rows.size(); ++row) rows[row] = stored.data() + row * row_bytes;
    if (!read_rows(png_, info_, rows.data()))
      return bad_input(path_.string() + " is damaged (" + message_.data() + "); copy or export it again");
    std::vector<std::uint16_t> values;
    values.reserve(count);
    for (const png_bytep row : rows)
      for (std::size_t column = 0; column < columns; ++column) {
        std::uint16_t value = row[column * bytes];
        if (bytes == 2) std::memcpy(&value, row + 2 * column, 2);
        values.push_back(value);
      }
    return values;
  }

 private:
  fs::path path_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  Message message_{};
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

// The inverse of DICOM's linear window (PS3.3 C.11.2.1.2.1): black is the first HU of the window, white the last.
GivenGeometry windowed(GivenGeometry given, const imaging::Window& window, int bits) {
  const double width_hu = window.width_hu - 1.0, white = (1 << bits) - 1;
  given.slope = width_hu / white;
  given.intercept = window.centre_hu - 0.5 - 0.5 * width_hu;
  return given;
}

std::string size_text(std::uint32_t width, std::uint32_t height, int bits) {
  return std::to_string(width) + "x" + std::to_string(height) + " with " + std::to_string(bits) + " bits";
}

}  // namespace

Result<CtScan> read_grey_stack(const fs::path& folder, const GreyFormat& format, const KeepGoing& keep_going) try {
  const auto files = numbered_files(folder, ".png", "a CT as grey PNG slices");
  if (!files) return tl::unexpected(files.error());
  if (files->size() < 2) return bad_input(folder.string() + " has one slice; give a scan with several");
  CtScan scan;
  imaging::HuVolume& volume = scan.volume;
  GivenGeometry given = format.given;
  int bits = 0;
  std::vector<std::int16_t> hu;  // of each grey value
  for (std::size_t i = 0; i < files->size(); ++i) {
    if (!keep_going(static_cast<double>(i) / static_cast<double>(files->size())))
      return stopped_while("reading " + folder.string());
    GreyPng png((*files)[i]);
    if (auto opened = png.open(); !opened) return tl::unexpected(opened.error());
    if (i == 0) {
      const double voxels = static_cast<double>(png.width()) * png.height() * static_cast<double>(files->size());
      if (std::min(png.width(), png.height()) < 2 || std::max(png.width(), png.height()) > imaging::kLargestScanAxis ||
          files->size() > imaging::kLargestScanAxis || voxels > kMostGivenVoxels ||
          static_cast<double>(png.width()) * png.height() > kMostSlicePixels)
        return bad_input(folder.string() + " has " + std::to_string(files->size()) + " slices of " +
                         std::to_string(png.width()) + "x" + std::to_string(png.height()) +
                         ", not 2 to 16384 along each axis, 64 million in a slice and 4e9 in all; give a part of it");
      bits = png.bits();
      if (format.window) given = windowed(given, *format.window, bits);
      volume = volume_of(
          {static_cast<int>(png.width()), static_cast<int>(png.height()), static_cast<int>(files->size())}, given);
      for (int value = 0; value < 1 << bits; ++value) hu.push_back(hu_of(value, given));
      volume.values.reserve(volume.count());
    }
    if (png.width() != static_cast<std::uint32_t>(volume.dims[0]) ||
        png.height() != static_cast<std::uint32_t>(volume.dims[1]) || png.bits() != bits)
      return bad_input(
          (*files)[i].string() + " is " + size_text(png.width(), png.height(), png.bits()) +
          " where the slices before are " +
          size_text(static_cast<std::uint32_t>(volume.dims[0]), static_cast<std::uint32_t>(volume.dims[1]), bits) +
          "; export the stack again");
    const auto pixels = png.pixels();
    if (!pixels) return tl::unexpected(pixels.error());
    for (const std::uint16_t value : *pixels) volume.values.push_back(hu[value]);
  }
  scan.source = source_of("PNG", volume, given);
  return scan;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, folder.string() + " takes more memory than this machine has; give a part of it");
}

}  // namespace osteon::import
