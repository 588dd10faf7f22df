// The import of a scan whose slices are far apart.
#include <cmath>

#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

constexpr double kRadius_mm = 12.0, kTilt = 1.0;

// A rod of bone in soft tissue, leaning by a radian from the slices' normal, on pixels of 0.75 mm.
CtScan leaning_rod(double slice_mm) {
  CtScan scan;
  scan.source = "test";
  imaging::HuVolume& volume = scan.volume;
  volume.dims = {56, 56, static_cast<int>(42.0 / slice_mm)};
  volume.spacing_mm = {0.75, 0.75, slice_mm};
  volume.origin_mm = {-20.6, -20.6, -20.4};
  const Vec3 axis(std::sin(kTilt), 0.0, std::cos(kTilt));
  for (int k = 0; k < volume.dims[2]; ++k)
    for (int j = 0; j < 56; ++j)
      for (int i = 0; i < 56; ++i) {
        double bone = 0.0;
        for (int part = 0; part < 8; ++part) {
          const Vec3 at = volume.position_mm(Vec3(i, j, k + (part + 0.5) / 8.0 - 0.5));
          const double s = std::max((at - at.dot(axis) * axis).norm() - 6.0, std::abs(at.dot(axis)) - kRadius_mm);
          bone += std::clamp(0.5 - s / 0.75, 0.0, 1.0) / 8.0;
        }
        volume.values.push_back(static_cast<std::int16_t>(std::lround(50.0 + 950.0 * bone)));
      }
  return scan;
}

// The mean of |S| at points on the round face of the rod.
double mean_error_mm(const Case& bone) {
  const Vec3 axis(std::sin(kTilt), 0.0, std::cos(kTilt)), across(std::cos(kTilt), 0.0, -std::sin(kTilt));
  double sum = 0.0;
  int points = 0;
  for (double along = -8.0; along <= 8.0; along += 0.31)
    for (double angle = 0.0; angle < 6.28; angle += 0.1, ++points)
      sum +=
          std::abs(bone.surface_mm(along * axis + 6.0 * (std::cos(angle) * across + std::sin(angle) * Vec3::UnitY())));
  return sum / points;
}

Case imported(double slice_mm, BetweenSlices between) {
  auto made = import_bone(leaning_rod(slice_mm), {.threshold_hu = 226.0, .between_slices = between}, keep_going);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

TEST(ThickSlices, GetTheirSurfaceFromTheShapesOfSlices) {
  const Case usual = imported(3.0, BetweenSlices::automatic), shapes = imported(3.0, BetweenSlices::shapes),
             hu = imported(3.0, BetweenSlices::hu);
  EXPECT_EQ(usual.hash(), shapes.hash());
  EXPECT_NE(usual.hash(), hu.hash());
  EXPECT_EQ(usual.info().source, "test, shapes interpolated between slices");
  EXPECT_EQ(hu.info().source, "test");
  std::printf("mean deviation %.2f mm by HU, %.2f mm by shapes\n", mean_error_mm(hu), mean_error_mm(usual));
  EXPECT_LT(mean_error_mm(usual), 0.7 * mean_error_mm(hu));
  EXPECT_LT(mean_error_mm(usual), 0.6);
}

TEST(ThickSlices, ThinOnesStayAsTheyWere) {
  const Case usual = imported(1.0, BetweenSlices::automatic), hu = imported(1.0, BetweenSlices::hu);
  EXPECT_EQ(usual.hash(), hu.hash());
}

TEST(ThickSlices, ShapesCanBeStopped) {
  for (const double at : {0.36, 0.45, 0.6, 0.8}) {
    const auto stopped = import_bone(leaning_rod(3.0), {}, [&](double done) { return done < at; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace osteon::import
