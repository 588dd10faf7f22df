// Targets for scans whose geometry a person gives: raw numbers, and a grey PNG slice.
#include <png.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include "common/core/check.hpp"
#include "server/import/grey_stack.hpp"
#include "server/import/raw_volume.hpp"
#include "tests/fuzz/import_files.hpp"
#include "tests/fuzz/import_targets.hpp"

namespace osteon::fuzz {
namespace {

constexpr int kGreyWidth = 6, kGreyHeight = 5;
constexpr std::size_t kMostRead = 1 << 20;  // voxels: a size that claims more is parsed, and no file has so many bytes

bool never_stop(double) { return true; }

void check_scan(const import::CtScan& scan) {
  OSTEON_CHECK(scan.volume.values.size() == scan.volume.count());
  OSTEON_CHECK(std::abs(std::abs(scan.volume.directions.determinant()) - 1.0) < 1e-9);
}

// A line with size and axes as on a command line, and then the file.
void read_raw(std::span<const std::uint8_t> data) {
  static const InputFile file("scan.raw");
  const std::string text(data.begin(), data.end());
  const std::size_t line = std::min(text.find('\n'), text.size()), blank = std::min(text.find(' '), line);
  const auto size = import::parse_size(std::string_view(text).substr(0, blank));
  const auto axes = import::parse_axes(std::string_view(text).substr(std::min(blank + 1, line), line - blank));
  if (!size) expect_bounded(size.error());
  if (!axes) expect_bounded(axes.error());
  if (!size || !axes) return;
  import::RawFormat format;
  format.size = *size;
  format.given.directions = *axes;
  if (static_cast<double>(format.size[0]) * format.size[1] * format.size[2] > static_cast<double>(kMostRead)) return;
  const auto path = file.write(data.subspan(std::min(line + 1, data.size())));
  for (const auto type : {import::RawType::int16, import::RawType::uint8, import::RawType::float32})
    for (const bool big : {false, true}) {
      format.type = type;
      format.big_endian = big;
      const auto scan = import::read_raw_volume(path, format, never_stop);
      if (!scan)
        expect_bounded(scan.error());
      else
        check_scan(*scan);
    }
}

// The same slice twice: one is no volume.
void read_grey_slice(std::span<const std::uint8_t> data) {
  static const InputFile file("slice1.png");
  const auto path = file.write(data);
  std::filesystem::copy_file(path, file.folder() / "slice2.png", std::filesystem::copy_options::overwrite_existing);
  import::GreyFormat format;
  format.window = imaging::Window{};
  const auto scan = import::read_grey_stack(file.folder(), format, never_stop);
  if (!scan) return expect_bounded(scan.error());
  check_scan(*scan);
}

Bytes grey_slice(png_uint_32 format) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = kGreyWidth;
  image.height = kGreyHeight;
  image.format = format;
  const std::vector<png_byte> pixels(PNG_IMAGE_SIZE(image), 77);
  const InputFile file("slice1.png");
  const auto path = file.write({});
  OSTEON_CHECK(png_image_write_to_file(&image, path.c_str(), 0, pixels.data(), 0, nullptr) != 0);
  return bytes_of_file(path);
}

}  // namespace

Target raw_volume_target() {
  return {"raw_volume",
          read_raw,
          {bytes_of_text("5,4,3 LPS\n" + std::string(120, 'v')), bytes_of_text("5,4,3 ARI\n" + std::string(60, '\0')),
           bytes_of_text("2,3,4 SLA\n" + std::string(96, '\xff'))}};
}

Target grey_slice_target() {
  Target target{"grey_slice",
                read_grey_slice,
                {grey_slice(PNG_FORMAT_GRAY), grey_slice(PNG_FORMAT_LINEAR_Y), grey_slice(PNG_FORMAT_LINEAR_Y_ALPHA),
                 grey_slice(PNG_FORMAT_RGB)}};
  target.mutations = 100;
  return target;
}

}  // namespace osteon::fuzz
