#include "common/volume/iso_surface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/imaging/always.hpp"

namespace osteon {
namespace {

constexpr double kPitch_mm = 0.5;

// A field with values like HU whose value 300 lies at distance zero. The edge is `blur_mm` wide, as a scanner blurs it.
template <class Distance>
DenseVolume<float> edge_field(const CoordBox& box, double blur_mm, Distance distance_mm) {
  DenseVolume<float> field(box, 0.0f);
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const double inside = std::clamp(0.5 - distance_mm(position_mm({x, y, z}, kPitch_mm)) / blur_mm, 0.0, 1.0);
        field.at({x, y, z}) = static_cast<float>(-1000.0 + 2600.0 * inside);
      }
  return field;
}

// Largest error in voxels over the samples whose true distance is within `within_mm`. Samples near the box's faces are
// left out. There the nearest point of the true surface lies beyond the box, where the field continues with its edge's
// value.
template <class Distance>
double worst_error(const DenseVolume<float>& field, double within_mm, Distance distance_mm) {
  const auto s = signed_distance_mm(field, 300.0f, kPitch_mm, imaging::always);
  EXPECT_TRUE(s);
  double worst = 0.0;
  const CoordBox& box = field.box;
  const CoordBox inner = box.grown(-6);
  for (int x = inner.min.x; x <= inner.max.x; ++x)
    for (int y = inner.min.y; y <= inner.max.y; ++y)
      for (int z = inner.min.z; z <= inner.max.z; ++z) {
        const double truth = distance_mm(position_mm({x, y, z}, kPitch_mm));
        if (std::abs(truth) < within_mm)
          worst = std::max(worst, std::abs(static_cast<double>(s->at({x, y, z})) - truth) / kPitch_mm);
      }
  return worst;
}

TEST(IsoSurface, TiltedPlaneIsExact) {
  const Vec3 normal = Vec3(1.0, 0.4, -0.7).normalized();
  const auto distance = [&](const Vec3& p) { return normal.dot(p) - 0.23; };
  // Such a wide blur is linear over the whole box, like the interpolation.
  const auto field = edge_field({{-30, -30, -30}, {30, 30, 30}}, 200.0, distance);
  EXPECT_LT(worst_error(field, 3.9 * kPitch_mm, distance), 0.005);
}

TEST(IsoSurface, SphereIsAsNearAsItsFacetsCanBeWhereTheEdgeIsWide) {
  const double radius_mm = 8.0;
  const auto distance = [&](const Vec3& p) { return (p - Vec3(0.11, -0.07, 0.2)).norm() - radius_mm; };
  const auto field = edge_field({{-24, -24, -24}, {24, 24, 24}}, 40.0, distance);
  // r is 16 voxels. A point in the middle of a cell's crossings lies inside by up to the sagitta of the cell's
  // diagonal, 3/(8 r) = 0.023 voxel. A facet between such points lies inside by the sagitta of its own diagonal, 0.016,
  // in addition.
  EXPECT_LT(worst_error(field, 3.9 * kPitch_mm, distance), 0.045);
}

TEST(IsoSurface, ErrorOfASphereShrinksWithItsCurvature) {
  const auto error = [](double radius_mm) {
    const auto distance = [&](const Vec3& p) { return (p - Vec3(0.11, -0.07, 0.2)).norm() - radius_mm; };
    const int reach = static_cast<int>(radius_mm / kPitch_mm) + 12;
    return worst_error(edge_field({{-reach, -reach, -reach}, {reach, reach, reach}}, 80.0, distance), 3.9 * kPitch_mm,
                       distance);
  };
  EXPECT_LT(error(16.0), 0.6 * error(8.0));  // in proportion to 1 / r
}

TEST(IsoSurface, SphereIsWithinATenthOfAVoxelAtAScannersEdge) {
  const double radius_mm = 8.0;
  const auto distance = [&](const Vec3& p) { return (p - Vec3(0.11, -0.07, 0.2)).norm() - radius_mm; };
  const auto field = edge_field({{-24, -24, -24}, {24, 24, 24}}, 2.0 * kPitch_mm, distance);
  EXPECT_LT(worst_error(field, 3.9 * kPitch_mm, distance), 0.1);
}

TEST(IsoSurface, EnclosedCavityIsOutside) {
  const auto distance = [](const Vec3& p) { return std::max(p.norm() - 10.0, 6.0 - p.norm()); };
  const auto field = edge_field({{-28, -28, -28}, {28, 28, 28}}, 40.0, distance);
  const auto s = signed_distance_mm(field, 300.0f, kPitch_mm, imaging::always);
  ASSERT_TRUE(s);
  EXPECT_GT(s->at({0, 0, 0}), 0.0f);
  EXPECT_LT(s->at({16, 0, 0}), 0.0f);
  EXPECT_GT(s->at({28, 0, 0}), 0.0f);
  EXPECT_LT(worst_error(field, 3.0 * kPitch_mm, distance), 0.05);
}

TEST(IsoSurface, IsClippedToFourPitches) {
  const auto distance = [](const Vec3& p) { return p.x(); };
  const auto field = edge_field({{-40, -3, -3}, {40, 3, 3}}, 200.0, distance);
  const auto s = signed_distance_mm(field, 300.0f, kPitch_mm, imaging::always);
  ASSERT_TRUE(s);
  for (int x = -40; x <= 40; ++x) {
    const double expected = std::clamp(x * kPitch_mm, -4.0 * kPitch_mm, 4.0 * kPitch_mm);
    EXPECT_NEAR(s->at({x, 0, 0}), expected, 0.005) << "x " << x;
  }
}

TEST(IsoSurface, SamplesAtTheThresholdAreInside) {
  DenseVolume<float> field({{0, 0, 0}, {20, 7, 7}}, -100.0f);
  for (int x = 0; x <= 10; ++x)
    for (int y = 0; y <= 7; ++y)
      for (int z = 0; z <= 7; ++z) field.at({x, y, z}) = 300.0f;
  const auto s = signed_distance_mm(field, 300.0f, kPitch_mm, imaging::always);
  ASSERT_TRUE(s);
  EXPECT_LE(s->at({10, 4, 4}), 0.0f);
  EXPECT_TRUE(std::signbit(s->at({10, 4, 4})));
  EXPECT_GT(s->at({11, 4, 4}), 0.0f);
  EXPECT_NEAR(s->at({8, 4, 4}), -2.0 * kPitch_mm, 0.01);
}

TEST(IsoSurface, SlabsMeetWithoutASeam) {
  // Longer than two slabs: a plane along x must give the same everywhere.
  const auto distance = [](const Vec3& p) { return 0.6 * p.y() + 0.8 * p.z() - 0.1; };
  const auto field = edge_field({{-5, -24, -24}, {150, 24, 24}}, 200.0, distance);
  EXPECT_LT(worst_error(field, 3.0 * kPitch_mm, distance), 0.005);
}

TEST(IsoSurface, EqualFieldsGiveEqualBytes) {
  const auto distance = [](const Vec3& p) { return p.norm() - 9.0 + std::sin(3.0 * p.x()) * std::cos(2.0 * p.y()); };
  const auto field = edge_field({{-80, -26, -26}, {80, 26, 26}}, 1.0, distance);
  const auto first = signed_distance_mm(field, 300.0f, kPitch_mm, imaging::always);
  ASSERT_TRUE(first);
  for (int again = 0; again < 3; ++again) {
    const auto next = signed_distance_mm(field, 300.0f, kPitch_mm, imaging::always);
    ASSERT_TRUE(next);
    EXPECT_EQ(first->values, next->values);
  }
}

TEST(IsoSurface, StopsWhenAsked) {
  const DenseVolume<float> field({{0, 0, 0}, {300, 8, 8}}, 0.0f);
  const auto s = signed_distance_mm(field, 300.0f, kPitch_mm, [](double) { return false; });
  ASSERT_FALSE(s);
  EXPECT_EQ(s.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon
