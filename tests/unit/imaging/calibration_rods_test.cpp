#include "common/imaging/calibration_rods.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

constexpr double kPixel_mm = 0.8, kSlice_mm = 2.0, kNoise_hu = 15.0;
constexpr double kHuPerDensity = 1200.0, kHuOfNothing = -12.0;

// A patient on a phantom. HU are those of the scanner, with noise.
class Scan {
 public:
  Scan() {
    volume_.dims = {120, 120, 24};
    volume_.spacing_mm = {kPixel_mm, kPixel_mm, kSlice_mm};
    volume_.origin_mm = {-40.0, -60.0, 7.0};
    volume_.values.assign(volume_.count(), -1000);
    paint([](double x, double y, int) { return std::hypot((x - 48) / 42, (y - 36) / 30) < 1; }, 45.0);
    paint([](double x, double y, int z) { return std::hypot(x - 48, y - 48) < 12 - 0.15 * z; }, 260.0);  // a vertebra
    disc(30.0, 36.0, 9.0, 190.0);                                                                        // a vessel
    paint([](double x, double y, int) { return x > 5 && x < 91 && y > 66 && y < 86; }, 70.0);            // the phantom
  }
  // In mm from the first voxel. `lean`: sideways over the whole scan.
  Scan& disc(double x, double y, double radius, double hu, double lean_mm = 0.0, int slices = 24) {
    const int last = volume_.dims[2];
    return paint(
        [=](double px, double py, int slice) {
          return slice < slices && std::hypot(px - x - lean_mm * (slice + 0.5) / last, py - y) < radius;
        },
        hu);
  }
  Scan& rod(double x, double density, double lean_mm = 0.0, int slices = 24) {
    return disc(x, 76.0, 7.0, kHuOfNothing + kHuPerDensity * density, lean_mm, slices);
  }
  [[nodiscard]] HuVolume noisy() const {
    HuVolume out = volume_;
    std::minstd_rand random(7);
    std::normal_distribution<double> noise(0.0, kNoise_hu);
    for (std::int16_t& hu : out.values) hu = static_cast<std::int16_t>(std::lround(hu + noise(random)));
    return out;
  }

 private:
  // Pixels on the edge get the mean of 3 x 3 points.
  template <class Inside>
  Scan& paint(Inside inside, double hu) {
    for (int z = 0; z < volume_.dims[2]; ++z)
      for (int y = 0; y < volume_.dims[1]; ++y)
        for (int x = 0; x < volume_.dims[0]; ++x) {
          int part = 0;
          for (int i = -1; i <= 1; ++i)
            for (int j = -1; j <= 1; ++j)
              part += inside((x + i / 3.0) * kPixel_mm, (y + j / 3.0) * kPixel_mm, z) ? 1 : 0;
          std::int16_t& to = volume_.values[volume_.index(x, y, z)];
          to = static_cast<std::int16_t>(std::lround(to + (hu - to) * part / 9.0));
        }
    return *this;
  }
  HuVolume volume_;
};

const HuVolume& four_rods() {
  static const HuVolume made = Scan().rod(15.0, 0.2).rod(37.0, 0.0).rod(59.0, 0.8).rod(81.0, 0.4).noisy();
  return made;
}

TEST(CalibrationRods, AreFoundUnderThePatient) {
  const HuVolume& scan = four_rods();
  const std::vector<double> densities{0.0, 0.2, 0.4, 0.8};
  const auto rods = find_rods(scan, densities, always);
  ASSERT_TRUE(rods) << rods.error().message;
  ASSERT_EQ(rods->size(), 4u);
  const double x_mm[] = {37.0, 15.0, 81.0, 59.0};
  std::vector<DensityReading> readings;
  for (std::size_t i = 0; i < 4; ++i) {
    const CalibrationRod& rod = (*rods)[i];
    EXPECT_EQ(rod.reading.density_g_cm3, densities[i]);
    // The mean of more than 1000 voxels is exact to 0.5 HU.
    EXPECT_NEAR(rod.reading.hu, kHuOfNothing + kHuPerDensity * densities[i], 2.0);
    EXPECT_NEAR(rod.deviation_hu, kNoise_hu, 1.5);
    EXPECT_NEAR(rod.centre_mm.x(), -40.0 + x_mm[i], 0.4);
    EXPECT_NEAR(rod.centre_mm.y(), -60.0 + 76.0, 0.4);
    EXPECT_NEAR(rod.centre_mm.z(), 7.0 + 23.0, 1e-9);
    EXPECT_LT(rod.diameter_mm, 14.0);
    EXPECT_GT(rod.diameter_mm, 7.0);
    EXPECT_NEAR(rod.length_mm, 48.0, 1e-9);
    readings.push_back(rod.reading);
  }
  const auto line = fit_calibration(readings);
  ASSERT_TRUE(line);
  EXPECT_NEAR(line->hu_per_g_cm3, kHuPerDensity, 0.005 * kHuPerDensity);
}

TEST(CalibrationRods, MayLeanAndBeShorterThanTheScan) {
  const HuVolume scan = Scan().rod(15.0, 0.0, 6.0).rod(37.0, 0.1, 6.0, 18).rod(59.0, 0.2, 6.0).noisy();
  const auto rods = find_rods(scan, std::vector{0.2, 0.1, 0.0}, always);
  ASSERT_TRUE(rods) << rods.error().message;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR((*rods)[i].reading.density_g_cm3, 0.1 * static_cast<double>(i), 1e-12);
    EXPECT_NEAR((*rods)[i].reading.hu, kHuOfNothing + kHuPerDensity * 0.1 * static_cast<double>(i), 2.0);
  }
  EXPECT_NEAR((*rods)[0].centre_mm.x(), -40.0 + 18.0, 0.4);
}

TEST(CalibrationRods, ThatAreNotThereAreMissed) {
  const auto refused = find_rods(Scan().rod(37.0, 0.0).noisy(), std::vector{0.0, 0.2, 0.4, 0.8}, always);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
  EXPECT_NE(refused.error().message.find("does not show 4 uniform rods"), std::string::npos) << refused.error().message;
}

// Two rods, a vessel and a vertebra: three of them rise with the densities, but are no rods.
TEST(CalibrationRods, OtherRoundThingsAreNotTakenForThem) {
  const auto refused = find_rods(Scan().rod(37.0, 0.0).rod(81.0, 0.1).noisy(), std::vector{0.0, 0.1, 0.2}, always);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("does not show 3 uniform rods"), std::string::npos) << refused.error().message;
}

TEST(CalibrationRods, HaveSeveralDensities) {
  const HuVolume& scan = four_rods();
  for (const std::vector<double>& wrong : {std::vector<double>{}, {0.2}, {0.2, 0.2}, std::vector<double>(9, 0.1)})
    EXPECT_FALSE(find_rods(scan, wrong, always));
}

TEST(CalibrationRods, TheSearchCanBeStopped) {
  const HuVolume& scan = four_rods();
  for (int calls = 0; calls < 20; calls += 5) {
    int left = calls;
    const auto stopped = find_rods(scan, std::vector{0.0, 0.2, 0.4, 0.8}, [&](double) { return left-- > 0; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace osteon::imaging
