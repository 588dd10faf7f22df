#include "common/imaging/point_spread.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

// A cube of soft tissue with turned faces in air, blurred along each axis of the voxels.
HuVolume blurred_block(const Vec3& spacing_mm, const Vec3& sigma_mm, double noise_hu) {
  HuVolume volume;
  volume.dims = {48, 48, static_cast<int>(36.0 / spacing_mm.z())};
  volume.spacing_mm = spacing_mm;
  std::minstd_rand random(5);
  std::normal_distribution<double> noise(0.0, noise_hu);
  const auto phi = [](double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); };
  const Vec3 middle = 0.5 * spacing_mm.cwiseProduct(Vec3(47, 47, volume.dims[2] - 1));
  for (int z = 0; z < volume.dims[2]; ++z)
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 48; ++x) {
        const Vec3 p = spacing_mm.cwiseProduct(Vec3(x, y, z)) - middle;
        double inside = 1.0;
        // Far from its edges and corners, a face blurs as a plane does.
        for (int axis = 0; axis < 3; ++axis)
          inside *= phi((10.0 - p[axis]) / sigma_mm[axis]) * phi((10.0 + p[axis]) / sigma_mm[axis]);
        volume.values.push_back(static_cast<std::int16_t>(std::lround(-1000.0 + 1040.0 * inside + noise(random))));
      }
  return volume;
}

// Interpolation between voxels adds a sixth of their squared edge.
double interpolated(double sigma_mm, double spacing_mm) { return std::hypot(sigma_mm, spacing_mm / std::sqrt(6.0)); }

TEST(PointSpread, IsMeasuredAlongEachAxis) {
  const Vec3 spacing(0.6, 0.6, 1.0), sigma(0.6, 0.6, 0.95);
  const auto spread = measure_point_spread(blurred_block(spacing, sigma, 15.0), always);
  ASSERT_TRUE(spread);
  EXPECT_GT(spread->edges, 500);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_TRUE(spread->measured[static_cast<std::size_t>(axis)]);
    const double truth = interpolated(sigma[axis], spacing[axis]);
    EXPECT_NEAR(spread->sigma_mm[axis], truth, 0.05 * truth) << axis;
  }
  EXPECT_NEAR(spread->along_mm(Vec3(0.6, 0.0, 0.8)), std::hypot(0.6 * spread->sigma_mm.x(), 0.8 * spread->sigma_mm.z()),
              1e-12);
}

TEST(PointSpread, IsAssumedWhereNoEdgeShowsIt) {
  HuVolume empty;
  empty.dims = {20, 20, 20};
  empty.spacing_mm = {0.5, 0.6, 2.0};
  empty.values.assign(empty.count(), 40);
  const auto spread = measure_point_spread(empty, always);
  ASSERT_TRUE(spread);
  EXPECT_EQ(spread->edges, 0);
  EXPECT_EQ(spread->measured, (std::array<bool, 3>{}));
  EXPECT_NEAR(spread->sigma_mm.z(), 1.0, 1e-12);
  EXPECT_NEAR(spread->sigma_mm.x(), 0.25, 1e-12);
}

TEST(PointSpread, TheMeasurementCanBeStopped) {
  const auto stopped =
      measure_point_spread(blurred_block({1, 1, 1}, {0.6, 0.6, 0.6}, 0.0), [](double d) { return d < 0.3; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon::imaging
