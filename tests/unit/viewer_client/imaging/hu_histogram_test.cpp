#include "viewer_client/imaging/hu_histogram.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace osteon {
namespace {

TEST(HuHistogram, CountsEachVoxelOnce) {
  ShownScan scan;
  scan.values = {-1024, -1009, -1008, 0, 0, 15, 16, 3071, 3072, 32767, -32768};
  const HuHistogram histogram = histogram_of(scan);
  EXPECT_EQ(histogram.counts[0], 3);  // -1024 to -1009, and what is below
  EXPECT_EQ(histogram.counts[1], 1);
  EXPECT_EQ(histogram.counts[64], 3);  // 0 to 15
  EXPECT_EQ(histogram.counts[65], 1);
  EXPECT_EQ(histogram.counts[255], 3);  // from 3056 on, and what is above
  EXPECT_EQ(std::accumulate(histogram.counts.begin(), histogram.counts.end(), std::int64_t{0}), 11);
}

// log(1 + n) / log(1 + most)
TEST(HuHistogram, IsDrawnLogarithmically) {
  HuHistogram histogram;
  histogram.counts[3] = 999;
  histogram.counts[5] = 9;
  const auto heights = heights_of(histogram);
  EXPECT_DOUBLE_EQ(heights[3], 1.0);
  EXPECT_NEAR(heights[5], 1.0 / 3.0, 1e-12);
  EXPECT_EQ(heights[4], 0.0);
  for (const double height : heights_of(HuHistogram{})) EXPECT_EQ(height, 0.0);
}

TEST(HuHistogram, FindsAHuUnderThePointer) {
  EXPECT_DOUBLE_EQ(pixel_of_hu(kFirst_hu, 512.0), 0.0);
  EXPECT_DOUBLE_EQ(pixel_of_hu(1024.0, 512.0), 256.0);
  for (const double hu : {-1000.0, 0.0, 226.0, 3000.0})
    EXPECT_NEAR(hu_of_pixel(pixel_of_hu(hu, 311.0), 311.0), hu, 1e-9);
  EXPECT_EQ(hu_of_pixel(10.0, 0.0), kFirst_hu);
}

}  // namespace
}  // namespace osteon
