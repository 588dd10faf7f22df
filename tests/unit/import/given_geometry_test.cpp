// Raw numbers and grey PNG slices, whose geometry a person gives.
#include "server/import/given_geometry.hpp"

#include <png.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <limits>

#include "server/import/grey_stack.hpp"
#include "server/import/raw_volume.hpp"
#include "server/import/slice_images.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr int kColumns = 5, kRows = 4, kSlices = 3;

// Differs along each axis, and needs both bytes.
int stored_at(int i, int j, int k) { return 1 + i + 20 * j + 300 * k; }

template <class T>
std::string stored_bytes(T value, bool big) {
  std::string bytes(sizeof(T), '\0');
  const auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  std::ranges::copy(raw, bytes.begin());
  if (big == (std::endian::native == std::endian::little)) std::ranges::reverse(bytes);
  return bytes;
}

template <class T>
std::string slice_bytes(int k, bool big = false) {
  std::string bytes;
  for (int j = 0; j < kRows; ++j)
    for (int i = 0; i < kColumns; ++i) bytes += stored_bytes(static_cast<T>(stored_at(i, j, k)), big);
  return bytes;
}
template <class T>
std::string volume_bytes(bool big = false) {
  return slice_bytes<T>(0, big) + slice_bytes<T>(1, big) + slice_bytes<T>(2, big);
}

void write(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

RawFormat format_of(RawType type, bool big = false) {
  RawFormat format;
  format.size = {kColumns, kRows, kSlices};
  format.type = type;
  format.big_endian = big;
  format.given.spacing_mm = {0.5, 0.75, 2.0};
  return format;
}

class Given : public ::testing::Test {
 protected:
  void expect_values(const Result<CtScan>& scan, double slope = 1.0, double intercept = 0.0, int mask = 0xffff) const {
    ASSERT_TRUE(scan) << scan.error().message;
    ASSERT_EQ(scan->volume.dims, (std::array<int, 3>{kColumns, kRows, kSlices}));
    for (int k = 0; k < kSlices; ++k)
      for (int j = 0; j < kRows; ++j)
        for (int i = 0; i < kColumns; ++i)
          ASSERT_EQ(scan->volume.at(i, j, k), std::lround(slope * (stored_at(i, j, k) & mask) + intercept))
              << i << " " << j << " " << k;
  }
  void expect_refused(const Result<CtScan>& scan, const std::string& why) const {
    ASSERT_FALSE(scan) << why;
    expect_one_sentence(scan.error(), why);
    EXPECT_NE(scan.error().message.find(';'), std::string::npos) << "no remedy: " << scan.error().message;
  }
  test::TempDir folder_;
  const fs::path file_ = folder_ / "scan.raw";
};

TEST_F(Given, RawNumbersOfEveryTypeAndByteOrder) {
  for (const bool big : {false, true}) {
    write(file_, volume_bytes<std::int16_t>(big));
    expect_values(read_raw_volume(file_, format_of(RawType::int16, big), keep_going));
    write(file_, volume_bytes<std::uint16_t>(big));
    expect_values(read_raw_volume(file_, format_of(RawType::uint16, big), keep_going));
    write(file_, volume_bytes<float>(big));
    expect_values(read_raw_volume(file_, format_of(RawType::float32, big), keep_going));
    write(file_, volume_bytes<std::uint8_t>(big));
    expect_values(read_raw_volume(file_, format_of(RawType::uint8, big), keep_going), 1.0, 0.0, 0xff);
  }
}

TEST_F(Given, SlopeInterceptAndSkippedBytes) {
  RawFormat format = format_of(RawType::uint16);
  format.skip_bytes = 7;
  format.given.slope = 0.5;
  format.given.intercept = -1000.25;
  write(file_, "header:" + volume_bytes<std::uint16_t>());
  expect_values(read_raw_volume(file_, format, keep_going), 0.5, -1000.25);
}

TEST_F(Given, NumbersBeyondHuAreClampedAndWhatIsNoNumberIsAir) {
  std::string bytes = stored_bytes(std::numeric_limits<float>::quiet_NaN(), false) + stored_bytes(1e9f, false) +
                      stored_bytes(-1e9f, false) + stored_bytes(99.6f, false) +
                      stored_bytes(-std::numeric_limits<float>::infinity(), false);
  bytes.resize(4 * kColumns * kRows * kSlices);
  write(file_, bytes);
  const auto scan = read_raw_volume(file_, format_of(RawType::float32), keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  const std::vector<std::int16_t> first(scan->volume.values.begin(), scan->volume.values.begin() + 6);
  EXPECT_EQ(first, (std::vector<std::int16_t>{-1024, 32767, -32768, 100, -1024, 0}));
  EXPECT_EQ(scan->report.without_number, 2);
}

TEST_F(Given, ARawSliceInEachFile) {
  const fs::path folder = folder_ / "slices";
  fs::create_directory(folder);
  write(folder / "README.md", "not a slice");
  for (int k = 0; k < kSlices; ++k)
    write(folder / ("head." + std::to_string(9 + k)), "h" + slice_bytes<std::int16_t>(k));
  RawFormat format = format_of(RawType::int16);
  format.skip_bytes = 1;
  expect_values(read_raw_volume(folder, format, keep_going));
  format.size[2] = 4;
  expect_refused(read_raw_volume(folder, format, keep_going), "has 3 slices, but --size says 4");
  format.size[2] = 3;
  write(folder / "head.10", slice_bytes<std::int16_t>(1));
  expect_refused(read_raw_volume(folder, format, keep_going),
                 "head.10 has 40 bytes, but 5x4x1 voxels of int16 after 1 bytes need 41");
  fs::rename(folder / "head.10", folder / "head.12");
  expect_refused(read_raw_volume(folder, format, keep_going), "slice 10 is missing");
}

TEST_F(Given, AWrongNumberOfBytesNamesBoth) {
  const std::string whole = volume_bytes<std::int16_t>();
  for (const auto& [bytes, found] : {std::pair(whole.substr(1), "119"), {whole + "x", "121"}, {std::string(), "0"}}) {
    write(file_, bytes);
    expect_refused(read_raw_volume(file_, format_of(RawType::int16), keep_going),
                   "scan.raw has " + std::string(found) + " bytes, but 5x4x3 voxels of int16 need 120; correct --size");
  }
  expect_refused(read_raw_volume(folder_ / "absent", format_of(RawType::int16), keep_going), "there is no file");
  expect_refused(read_raw_volume(folder_.path(), format_of(RawType::int16), keep_going), "no numbered files");
}

TEST_F(Given, AxesSayWhereTheVoxelsLie) {
  write(file_, volume_bytes<std::int16_t>());
  RawFormat format = format_of(RawType::int16);
  const auto guessed = read_raw_volume(file_, format, keep_going);
  ASSERT_TRUE(guessed);
  EXPECT_NE(guessed->source.find("left and right may be swapped"), std::string::npos) << guessed->source;
  // Columns to the front, rows to the feet, slices to the right.
  const auto axes = parse_axes("AIR");
  ASSERT_TRUE(axes);
  format.given.directions = *axes;
  const auto scan = read_raw_volume(file_, format, keep_going);
  ASSERT_TRUE(scan);
  EXPECT_EQ(scan->volume.position_mm(Vec3(1, 0, 0)), Vec3(0.0, -0.5, 0.0));
  EXPECT_EQ(scan->volume.position_mm(Vec3(0, 1, 0)), Vec3(0.0, 0.0, -0.75));
  EXPECT_EQ(scan->volume.position_mm(Vec3(0, 0, 1)), Vec3(-2.0, 0.0, 0.0));
  EXPECT_TRUE(scan->source.ends_with("orientation as given")) << scan->source;
  EXPECT_EQ(*parse_axes("LPS"), Eigen::Matrix3d::Identity());
  for (const char* wrong : {"", "LP", "LPSI", "LRS", "LLS", "lps", "XYZ"}) {
    const auto refused = parse_axes(wrong);
    ASSERT_FALSE(refused) << wrong;
    expect_one_sentence(refused.error(), "--axes");
  }
}

TEST_F(Given, SizesAreWholeNumbersOfVoxels) {
  EXPECT_EQ(*parse_size("64,65,93"), (std::array<int, 3>{64, 65, 93}));
  for (const char* wrong : {"", "64", "64,64", "64,64,93,2", "64,64,1", "64,64,-5", "64,64,9x", "64 64 93",
                            "64,64,16385", "16384,16384,16384", "64,,93"}) {
    const auto refused = parse_size(wrong);
    ASSERT_FALSE(refused) << wrong;
    expect_one_sentence(refused.error(), "--size");
  }
}

TEST_F(Given, ReadingCanBeStopped) {
  write(file_, volume_bytes<std::int16_t>());
  const auto scan = read_raw_volume(file_, format_of(RawType::int16), [](double done) { return done < 0.5; });
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::cancelled);
}

// Writes values as a PNG of this depth by the library's low-level interface; `gamma` and `interlaced` do not change
// them.
void write_png(const fs::path& file, int bits, int colour, int k, bool interlaced = false) {
  std::FILE* out = std::fopen(file.c_str(), "wb");
  ASSERT_NE(out, nullptr);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, out);
  png_set_IHDR(png, info, kColumns, kRows, bits, colour, interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_gAMA(png, info, 1.0);
  png_write_info(png, info);
  const int channels = png_get_channels(png, info);
  std::vector<std::vector<png_byte>> rows;
  for (int j = 0; j < kRows; ++j) {
    rows.emplace_back();
    for (int i = 0; i < kColumns; ++i)
      for (int c = 0; c < channels; ++c) {
        const int value = stored_at(i, j, k);
        if (bits == 16) rows.back().push_back(static_cast<png_byte>(value >> 8));
        rows.back().push_back(static_cast<png_byte>(value));
      }
  }
  std::vector<png_bytep> pointers;
  for (auto& row : rows) pointers.push_back(row.data());
  png_write_image(png, pointers.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(out);
}

void write_stack(const fs::path& folder, int bits, int colour = PNG_COLOR_TYPE_GRAY, bool interlaced = false) {
  fs::create_directory(folder);
  for (int k = 0; k < kSlices; ++k)
    write_png(folder / ("slice" + std::to_string(9 + k) + ".png"), bits, colour, k, interlaced);
}

GreyFormat grey_format() {
  GreyFormat format;
  format.given.spacing_mm = {0.5, 0.75, 2.0};
  return format;
}

TEST_F(Given, GreySlicesKeepTheirNumbersWhateverTheirGamma) {
  int folder = 0;
  for (const bool interlaced : {false, true})
    for (const int colour : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA}) {
      const fs::path deep = folder_ / std::to_string(folder++), flat = folder_ / std::to_string(folder++);
      write_stack(deep, 16, colour, interlaced);
      write_stack(flat, 8, colour, interlaced);
      GreyFormat format = grey_format();
      format.given.slope = 2.0;
      format.given.intercept = -1024.0;
      expect_values(read_grey_stack(deep, format, keep_going), 2.0, -1024.0);
      expect_values(read_grey_stack(flat, format, keep_going), 2.0, -1024.0, 0xff);
    }
}

// What `osteon-import slices` shows comes back to half a step of grey.
TEST_F(Given, AGreyWindowIsTheInverseOfTheOneThatWroteTheSlices) {
  imaging::HuVolume volume;
  volume.dims = {6, 5, 4};
  volume.spacing_mm = {0.5, 0.75, 2.0};
  for (int i = 0; i < 6 * 5 * 4; ++i) volume.values.push_back(static_cast<std::int16_t>(-450 + 14 * i));
  SliceOptions options;
  options.window = {400.0, 1800.0};
  ASSERT_TRUE(write_slice_images(volume, folder_ / "images", options, keep_going));
  GreyFormat format = grey_format();
  format.window = options.window;
  const auto scan = read_grey_stack(folder_ / "images", format, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  for (std::size_t i = 0; i < volume.values.size(); ++i)
    EXPECT_NEAR(scan->volume.values[i], volume.values[i], 0.5 * 1799.0 / 255.0 + 0.5) << i;
}

TEST_F(Given, ReadingGreySlicesCanBeStopped) {
  write_stack(folder_ / "stack", 16);
  const auto scan = read_grey_stack(folder_ / "stack", grey_format(), [](double done) { return done < 0.5; });
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::cancelled);
}

TEST_F(Given, WrongGreySlicesAreOneSentence) {
  const fs::path stack = folder_ / "stack";
  const auto refused = [&](const std::string& why) {
    expect_refused(read_grey_stack(stack, grey_format(), keep_going), why);
  };
  refused("there is no folder");
  write_stack(stack, 16);
  write_png(stack / "slice10.png", 8, PNG_COLOR_TYPE_GRAY, 1);
  refused("slice10.png is 5x4 with 8 bits where the slices before are 5x4 with 16 bits");
  write_png(stack / "slice10.png", 8, PNG_COLOR_TYPE_RGB, 1);
  refused("slice10.png is in colours");
  write_png(stack / "slice10.png", 16, PNG_COLOR_TYPE_GRAY, 1);
  ASSERT_TRUE(read_grey_stack(stack, grey_format(), keep_going));
  truncate_file(stack / "slice10.png", 0.7);
  refused("slice10.png is damaged");
  write(stack / "slice10.png", "no picture");
  refused("slice10.png cannot be read as a PNG picture");
  fs::remove(stack / "slice10.png");
  refused("slice 10 is missing");
  fs::remove(stack / "slice11.png");
  refused("has one slice");
  fs::remove(stack / "slice9.png");
  refused("has no PNG files");
}

}  // namespace
}  // namespace osteon::import
