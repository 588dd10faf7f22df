#include "common/imaging/smoothing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

HuVolume volume_of(std::array<int, 3> dims, std::int16_t value = 0) {
  HuVolume volume;
  volume.dims = dims;
  volume.values.assign(volume.count(), value);
  return volume;
}

// Values of the whole range, many of them equal.
HuVolume random_volume(std::array<int, 3> dims, std::uint32_t seed) {
  HuVolume volume = volume_of(dims);
  std::mt19937 random(seed);
  for (std::int16_t& hu : volume.values)
    hu = static_cast<std::int16_t>(seed % 2 == 0 ? static_cast<int>(random() % 65536) - 32768
                                                 : static_cast<int>(random() % 5) * 100 - 200);
  return volume;
}

// The voxel at clamped coordinates.
std::int16_t nearest(const HuVolume& volume, int x, int y, int z) {
  return volume.at(std::clamp(x, 0, volume.dims[0] - 1), std::clamp(y, 0, volume.dims[1] - 1),
                   std::clamp(z, 0, volume.dims[2] - 1));
}

// By its definition: all values of the box in order.
HuVolume median_by_sorting(const HuVolume& volume, int slices_beside) {
  HuVolume out = volume;
  for (int z = 0; z < volume.dims[2]; ++z)
    for (int y = 0; y < volume.dims[1]; ++y)
      for (int x = 0; x < volume.dims[0]; ++x) {
        std::vector<std::int16_t> box;
        for (int dz = -slices_beside; dz <= slices_beside; ++dz)
          for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) box.push_back(nearest(volume, x + dx, y + dy, z + dz));
        std::ranges::sort(box);
        out.values[volume.index(x, y, z)] = box[box.size() / 2];
      }
  return out;
}

TEST(Smoothing, AMedianIsTheMiddleOfAllValuesInItsBox) {
  std::uint32_t seed = 0;
  for (const std::array<int, 3> dims : {std::array<int, 3>{37, 9, 6}, {1, 1, 1}, {2, 1, 5}, {64, 3, 1}, {5, 17, 2}})
    for (int round = 0; round < 4; ++round) {
      const HuVolume volume = random_volume(dims, seed++);
      HuVolume in_volume = volume, in_slice = volume;
      ASSERT_TRUE(smooth_median(in_volume, MedianBox::volume, always));
      ASSERT_TRUE(smooth_median(in_slice, MedianBox::slice, always));
      EXPECT_EQ(in_volume.values, median_by_sorting(volume, 1).values) << "seed " << seed - 1;
      EXPECT_EQ(in_slice.values, median_by_sorting(volume, 0).values) << "seed " << seed - 1;
    }
}

// The sum over all neighbours in double precision, axis after axis.
std::vector<double> gaussian_by_sums(const HuVolume& volume, double sigma_mm) {
  std::vector<double> values(volume.values.begin(), volume.values.end());
  for (int axis = 0; axis < 3; ++axis) {
    const double sigma = sigma_mm / volume.spacing_mm[axis];
    const int reach = static_cast<int>(std::ceil(4.0 * sigma));
    std::vector<double> next(values.size());
    for (int z = 0; z < volume.dims[2]; ++z)
      for (int y = 0; y < volume.dims[1]; ++y)
        for (int x = 0; x < volume.dims[0]; ++x) {
          double sum = 0.0, weights = 0.0;
          for (int d = -reach; d <= reach; ++d) {
            std::array<int, 3> at{x, y, z};
            const auto a = static_cast<std::size_t>(axis);
            at[a] = std::clamp(at[a] + d, 0, volume.dims[a] - 1);
            const double weight = std::exp(-0.5 * d * d / (sigma * sigma));
            sum += weight * values[volume.index(at[0], at[1], at[2])];
            weights += weight;
          }
          next[volume.index(x, y, z)] = sum / weights;
        }
    values = next;
  }
  return values;
}

TEST(Smoothing, AGaussianIsTheWeightedMean) {
  std::uint32_t seed = 0;
  for (const double sigma_mm : {0.4, 1.0, 2.3})
    for (const std::array<int, 3> dims : {std::array<int, 3>{37, 9, 6}, {1, 1, 1}, {2, 1, 5}, {5, 17, 20}}) {
      HuVolume volume = random_volume(dims, seed++);
      volume.spacing_mm = Vec3(0.5, 0.75, 2.0);
      const std::vector<double> expected = gaussian_by_sums(volume, sigma_mm);
      ASSERT_TRUE(smooth_gaussian(volume, sigma_mm, always));
      for (std::size_t i = 0; i < expected.size(); ++i)
        ASSERT_NEAR(volume.values[i], expected[i], 0.51) << "seed " << seed - 1 << ", voxel " << i;
    }
}

TEST(Smoothing, AGaussianTakesTheShareOfNoiseThatTheorySays) {
  HuVolume volume = volume_of({40, 40, 40});
  std::mt19937 random(7);
  std::normal_distribution<double> noise(300.0, 100.0);
  for (std::int16_t& hu : volume.values) hu = static_cast<std::int16_t>(std::lround(noise(random)));
  ASSERT_TRUE(smooth_gaussian(volume, 1.0, always));
  double sum = 0.0, squares = 0.0;
  int count = 0;
  for (int z = 5; z < 35; ++z)
    for (int y = 5; y < 35; ++y)
      for (int x = 5; x < 35; ++x, ++count) {
        const double hu = volume.at(x, y, z);
        sum += hu;
        squares += hu * hu;
      }
  const double mean = sum / count, deviation = std::sqrt(squares / count - mean * mean);
  EXPECT_NEAR(mean, 300.0, 1.0);
  // White noise keeps (2 sqrt(pi) sigma)^(-1/2) of its deviation along each axis.
  EXPECT_NEAR(deviation, 100.0 * std::pow(2.0 * std::sqrt(M_PI), -1.5), 1.0);
}

TEST(Smoothing, KeepsWhatIsEqualEverywhere) {
  for (const std::int16_t hu : {std::int16_t{-32768}, std::int16_t{-1024}, std::int16_t{0}, std::int16_t{32767}}) {
    HuVolume volume = volume_of({33, 7, 5}, hu);
    ASSERT_TRUE(smooth_gaussian(volume, 1.5, always));
    ASSERT_TRUE(smooth_median(volume, MedianBox::volume, always));
    ASSERT_TRUE(smooth_median(volume, MedianBox::slice, always));
    EXPECT_TRUE(std::ranges::all_of(volume.values, [&](std::int16_t v) { return v == hu; })) << hu;
  }
}

TEST(Smoothing, CanBeStopped) {
  const auto stop_in_the_middle = [](double done) { return done < 0.5; };
  HuVolume volume = random_volume({8, 8, 8}, 1);
  for (const auto& ended :
       {smooth_gaussian(volume, 1.0, stop_in_the_middle), smooth_median(volume, MedianBox::volume, stop_in_the_middle),
        smooth_median(volume, MedianBox::slice, stop_in_the_middle)}) {
    ASSERT_FALSE(ended);
    EXPECT_EQ(ended.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace osteon::imaging
