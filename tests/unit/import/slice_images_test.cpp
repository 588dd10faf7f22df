#include "server/import/slice_images.hpp"

#include <png.h>

#include <algorithm>

#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

struct Image {
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> pixels;
};

Image read_image(const fs::path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) return {};
  EXPECT_EQ(image.format, static_cast<png_uint_32>(PNG_FORMAT_GRAY)) << file;
  Image read{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  read.pixels.resize(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, read.pixels.data(), 0, nullptr) == 0) return {};
  return read;
}

// A cube of 1000 HU, 12 mm wide, around which there is 0 HU. A Gaussian of 1 mm reaches 4 mm, so the middle of each
// face does not see the others.
imaging::HuVolume cube() {
  imaging::HuVolume volume;
  volume.dims = {20, 22, 24};
  volume.values.assign(volume.count(), 0);
  for (int z = 6; z < 18; ++z)
    for (int y = 5; y < 17; ++y)
      for (int x = 4; x < 16; ++x) volume.values[volume.index(x, y, z)] = 1000;
  return volume;
}

TEST(SliceImages, HaveAPixelForEachVoxel) {
  const test::TempDir folder;
  // Within this window a HU is a step of grey: y = ((x - 127.5) / 255 + 0.5) 255 = x.
  SliceOptions options;
  options.window = {128.0, 256.0};
  imaging::HuVolume volume;
  volume.dims = {6, 5, 4};
  for (int i = 0; i < 6 * 5 * 4; ++i) volume.values.push_back(static_cast<std::int16_t>(2 * i));
  ASSERT_TRUE(write_slice_images(volume, folder / "images", options, keep_going));
  const auto files = files_of(folder / "images");
  ASSERT_EQ(files.size(), 4u);
  int expected = 0;
  for (const char* name : {"slice-0001.png", "slice-0002.png", "slice-0003.png", "slice-0004.png"}) {
    const Image image = read_image(folder / "images" / name);
    EXPECT_EQ(image.columns, 6);
    EXPECT_EQ(image.rows, 5);
    for (const std::uint8_t pixel : image.pixels) EXPECT_EQ(pixel, 2 * expected++);
  }
  EXPECT_EQ(expected, 6 * 5 * 4);
}

TEST(SliceImages, ShowEdges) {
  const test::TempDir folder;
  SliceOptions options;
  for (const SliceContent content : {SliceContent::gradient, SliceContent::canny}) {
    options.content = content;
    const fs::path out = folder / (content == SliceContent::canny ? "canny" : "gradient");
    ASSERT_TRUE(write_slice_images(cube(), out, options, keep_going));
    const Image middle = read_image(out / "slice-0012.png"), outside = read_image(out / "slice-0001.png");
    ASSERT_EQ(middle.pixels.size(), 20u * 22u);
    const auto pixel = [&](int x, int y) { return middle.pixels[static_cast<std::size_t>(y * 20 + x)]; };
    EXPECT_EQ(pixel(10, 11), 0);  // inside
    EXPECT_EQ(pixel(0, 0), 0);
    EXPECT_EQ(std::ranges::count(outside.pixels, 0), 20 * 22);
    // White on the four sides: 1000 HU over a Gaussian of 1 mm are up to 399 HU/mm, above the higher limit.
    for (const auto& [x, y] : {std::pair(4, 10), {15, 10}, {9, 5}, {9, 16}}) EXPECT_EQ(pixel(x, y), 255);
    if (content == SliceContent::canny) {
      EXPECT_EQ(std::ranges::count(middle.pixels, 0) + std::ranges::count(middle.pixels, 255), 20 * 22);
      EXPECT_EQ(pixel(3, 10), 0);  // a line of one voxel
      EXPECT_EQ(pixel(5, 10), 0);
    }
  }
}

TEST(SliceImages, FiltersComeFirst) {
  const test::TempDir folder;
  imaging::HuVolume speck = cube();
  speck.values[speck.index(10, 11, 12)] = 3000;
  SliceOptions options;
  options.median = imaging::MedianBox::slice;
  options.window = {1500.0, 3000.0};
  ASSERT_TRUE(write_slice_images(speck, folder / "images", options, keep_going));
  const Image image = read_image(folder / "images/slice-0013.png");
  ASSERT_EQ(image.pixels.size(), 20u * 22u);
  EXPECT_EQ(image.pixels[11 * 20 + 10], image.pixels[11 * 20 + 8]);
}

TEST(SliceImages, AreAllThereOrNone) {
  const test::TempDir folder;
  SliceOptions options;
  options.median = imaging::MedianBox::volume;
  options.gaussian_mm = 1.0;
  for (const SliceContent content : {SliceContent::grey, SliceContent::gradient, SliceContent::canny}) {
    options.content = content;
    int questions = 0;
    const fs::path whole = folder / "whole";
    ASSERT_TRUE(write_slice_images(cube(), whole, options, [&](double) { return ++questions > 0; }));
    fs::remove_all(whole);
    ASSERT_GE(questions, 3 * 24);
    for (int last = 0; last < questions; last += 5) {
      int asked = 0;
      const auto ended = write_slice_images(cube(), folder / "part", options, [&](double) { return asked++ < last; });
      ASSERT_FALSE(ended);
      EXPECT_EQ(ended.error().code, ErrorCode::cancelled);
      EXPECT_TRUE(fs::is_empty(folder.path()));
    }
  }
}

}  // namespace
}  // namespace osteon::import
