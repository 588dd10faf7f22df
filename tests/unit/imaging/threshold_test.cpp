// Suggested thresholds of histograms whose best threshold has a closed form.
#include "common/imaging/threshold.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

using Histogram = std::vector<std::int64_t>;

struct Normal {
  double mean_hu, deviation_hu, voxels;

  [[nodiscard]] double at(double hu) const {
    const double x = (hu - mean_hu) / deviation_hu;
    return voxels / (deviation_hu * std::sqrt(2.0 * M_PI)) * std::exp(-0.5 * x * x);
  }
};

Histogram histogram_of(const std::vector<Normal>& classes) {
  Histogram histogram(kHuValues, 0);
  for (int hu = -1500; hu <= 4000; ++hu)
    for (const Normal& normal : classes)
      histogram[static_cast<std::size_t>(hu - kLeastHu)] += std::llround(normal.at(hu));
  return histogram;
}

// The HU between the means at which a voxel of either class is as likely, by halving.
double equally_likely_hu(const Normal& soft, const Normal& bone) {
  double low = soft.mean_hu, high = bone.mean_hu;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (soft.at(middle) > bone.at(middle) ? low : high) = middle;
  }
  return low;
}

TEST(Threshold, IsWhereSoftTissueAndBoneAreEquallyLikely) {
  for (const Normal& bone : {Normal{900, 150, 1e12}, {700, 120, 1e11}, {1100, 180, 3e12}, {500, 60, 1e12}})
    for (const double deviation_hu : {20.0, 40.0, 60.0}) {
      const Normal soft{40, deviation_hu, 2e12};  // so many that no HU between the means is empty
      const auto found = suggest_threshold(histogram_of({soft, bone}));
      ASSERT_TRUE(found) << found.error().message;
      // The tails beyond the threshold belong to the wrong class. This moves the estimate by a few HU.
      EXPECT_NEAR(found->threshold_hu, equally_likely_hu(soft, bone), 8.0) << bone.mean_hu << ' ' << deviation_hu;
      EXPECT_NEAR(found->soft.mean_hu, soft.mean_hu, 3.0);
      EXPECT_NEAR(found->soft.deviation_hu, soft.deviation_hu, 3.0);
      EXPECT_NEAR(found->bone.mean_hu, bone.mean_hu, 3.0);
      EXPECT_NEAR(found->bone.part, bone.voxels / (soft.voxels + bone.voxels), 0.005);
      EXPECT_NE(found->reason.find(std::to_string(std::lround(found->threshold_hu)) + " HU"), std::string::npos);
    }
}

TEST(Threshold, OfEqualClassesIsHalfWay) {
  for (const double middle : {300.0, 420.0, 555.0}) {
    const auto found = suggest_threshold(histogram_of({{60, 50, 1e12}, {2.0 * middle - 60, 50, 1e12}}));
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->threshold_hu, middle, 1.0);
  }
}

TEST(Threshold, OfTwoValuesIsHalfWay) {
  Histogram histogram(kHuValues, 0);
  histogram[static_cast<std::size_t>(0 - kLeastHu)] = 1000;
  histogram[static_cast<std::size_t>(1000 - kLeastHu)] = 10;
  const auto found = suggest_threshold(histogram);
  ASSERT_TRUE(found);
  // Thresholds from 110 to 1000 are equally good.
  EXPECT_GT(found->threshold_hu, 0.0);
  EXPECT_LE(found->threshold_hu, 1000.0);
  EXPECT_NEAR(found->threshold_hu, 555.0, 1.0);
}

TEST(Threshold, AirAndMetalDoNotMoveIt) {
  const std::vector<Normal> tissue{{-90, 20, 5e6}, {45, 25, 2e7}, {800, 250, 4e6}};
  std::vector<Normal> with_others = tissue;
  with_others.push_back({-1000, 30, 9e8});
  with_others.push_back({3000, 60, 1e6});
  const auto alone = suggest_threshold(histogram_of(tissue)), among = suggest_threshold(histogram_of(with_others));
  ASSERT_TRUE(alone && among);
  EXPECT_EQ(alone->threshold_hu, among->threshold_hu);
  EXPECT_GT(alone->threshold_hu, 45 + 3 * 25) << "above muscle, and not between fat and muscle";
}

TEST(Threshold, NoBoneIsSaidSo) {
  const Histogram empty(kHuValues, 0);
  for (const Histogram& histogram : {empty, histogram_of({{40, 30, 1e7}}), histogram_of({{40, 100, 1e7}}),
                                     histogram_of({{-1000, 30, 1e7}}), histogram_of({{3000, 30, 1e7}}),
                                     histogram_of({{800, 100, 1e7}}), histogram_of({{-100, 20, 1e7}, {50, 20, 1e7}})}) {
    const auto found = suggest_threshold(histogram);
    ASSERT_FALSE(found) << found->reason;
    EXPECT_EQ(found.error().code, ErrorCode::invalid_input);
    EXPECT_NE(found.error().message.find("--threshold"), std::string::npos);
  }
}

TEST(Threshold, AHistogramCountsEachVoxelOnce) {
  HuVolume volume;
  volume.dims = {4, 3, 2};
  for (int i = 0; i < 24; ++i)
    volume.values.push_back(static_cast<std::int16_t>(i < 3 ? -32768 : i < 8 ? 32767 : 7 * (i % 2)));
  const auto histogram = hu_histogram(volume, always);
  ASSERT_TRUE(histogram);
  const auto count = [&](int hu) { return (*histogram)[static_cast<std::size_t>(hu - kLeastHu)]; };
  EXPECT_EQ(count(-32768), 3);
  EXPECT_EQ(count(32767), 5);
  EXPECT_EQ(count(0) + count(7), 16);
  EXPECT_EQ(count(0), 8);
  for (int stop = 1; stop <= 2; ++stop) {
    int asked = 0;
    const auto stopped = hu_histogram(volume, [&](double) { return ++asked < stop; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace osteon::imaging
