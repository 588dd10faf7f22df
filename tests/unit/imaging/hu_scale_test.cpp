#include "common/imaging/hu_scale.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/imaging/threshold.hpp"
#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

// A histogram of tissues with normal distributions.
class TissueHistogram {
 public:
  TissueHistogram& add(double mean_hu, double deviation_hu, double voxels) {
    for (int hu = kLeastHu; hu < kLeastHu + kHuValues; ++hu) {
      const double z = (hu - mean_hu) / deviation_hu;
      if (std::abs(z) > 6.0) continue;
      counts_[static_cast<std::size_t>(hu - kLeastHu)] +=
          std::llround(voxels * std::exp(-0.5 * z * z) / (deviation_hu * 2.5066282746));
    }
    return *this;
  }
  TissueHistogram& fill(int hu, std::int64_t voxels) {
    counts_[static_cast<std::size_t>(hu - kLeastHu)] += voxels;
    return *this;
  }
  [[nodiscard]] const std::vector<std::int64_t>& counts() const { return counts_; }

 private:
  std::vector<std::int64_t> counts_ = std::vector<std::int64_t>(kHuValues, 0);
};

// Air, fat, muscle and bone on a scale that is 4 % too small and shifted by 30 HU.
TissueHistogram shifted_body() {
  const auto seen = [](double hu) { return 0.96 * hu + 30.0; };
  return TissueHistogram()
      .add(seen(-1000.0), 12.0, 2e6)
      .add(seen(-100.0), 18.0, 6e5)
      .add(seen(45.0), 15.0, 5e5)
      .add(seen(900.0), 300.0, 2e5);
}

TEST(HuScale, IsReadFromAirAndMuscle) {
  const auto scale = measure_hu_scale(shifted_body().counts());
  ASSERT_TRUE(scale) << scale.error().message;
  EXPECT_NEAR(scale->air_hu, -930.0, 1.0);
  EXPECT_NEAR(scale->soft_tissue_hu, 0.96 * 45.0 + 30.0, 2.0);
  EXPECT_NEAR(scale->corrected(0.96 * 900.0 + 30.0), 900.0, 3.0);
  EXPECT_NEAR(scale->corrected(0.96 * -1000.0 + 30.0), -1000.0, 1.0);
}

TEST(HuScale, TheFillingBesideTheScannedCircleIsNoAir) {
  const auto scale = measure_hu_scale(shifted_body().fill(-1024, 3'000'000).counts());
  ASSERT_TRUE(scale) << scale.error().message;
  EXPECT_NEAR(scale->air_hu, -930.0, 1.0);
}

TEST(HuScale, AirWithoutNoiseIsAir) {
  const auto scale = measure_hu_scale(TissueHistogram().fill(-990, 1'000'000).fill(50, 500'000).counts());
  ASSERT_TRUE(scale) << scale.error().message;
  EXPECT_NEAR(scale->air_hu, -990.0, 0.5);
  EXPECT_NEAR(scale->soft_tissue_hu, 50.0, 0.5);
}

TEST(HuScale, WithoutAirOrSoftTissueItIsNotKnown) {
  const auto no_air = measure_hu_scale(TissueHistogram().add(45.0, 15.0, 1e6).counts());
  ASSERT_FALSE(no_air);
  EXPECT_NE(no_air.error().message.find("no air from -1200 to -800 HU"), std::string::npos) << no_air.error().message;
  const auto no_tissue = measure_hu_scale(TissueHistogram().add(-1000.0, 15.0, 1e6).counts());
  ASSERT_FALSE(no_tissue);
  EXPECT_NE(no_tissue.error().message.find("no soft tissue"), std::string::npos) << no_tissue.error().message;
}

// The error of 20 HU of soft tissue moves a line that is fixed at air: at 1090 HU, twice as far from air, by 40 HU.
TEST(HuScale, ItsErrorGrowsWithTheDistanceFromAir) {
  EXPECT_NEAR(HuScale::error_hu(-1000.0), 0.0, 1e-12);
  EXPECT_NEAR(HuScale::error_hu(45.0), 20.0, 1e-12);
  EXPECT_NEAR(HuScale::error_hu(1090.0), 40.0, 1e-12);
}

TEST(HuScale, EveryVoxelIsCorrected) {
  HuVolume volume;
  volume.dims = {3, 1, 2};
  volume.values = {-930, 73, 894, -32768, 32767, 0};
  ASSERT_TRUE(rescale_hu(volume, {-930.0, 73.2}, always));
  // -1000 + (hu + 930) / 0.96
  EXPECT_EQ(volume.values, (std::vector<std::int16_t>{-1000, 45, 900, -32768, 32767, -31}));
  EXPECT_FALSE(rescale_hu(volume, {-930.0, 73.2}, [](double) { return false; }));
}

}  // namespace
}  // namespace osteon::imaging
