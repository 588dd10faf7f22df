#include "common/imaging/label_volume.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace osteon::imaging {
namespace {

bool keep_going(double) { return true; }

// Voxels are bone where their centre is inside.
LabelVolume labelled(int edge, const std::function<bool(const Vec3&)>& inside) {
  LabelVolume volume;
  volume.dims = {edge, edge, edge};
  volume.labels = DenseVolume<std::uint8_t>({{0, 0, 0}, {edge - 1, edge - 1, edge - 1}}, 0);
  for (int x = 0; x < edge; ++x)
    for (int y = 0; y < edge; ++y)
      for (int z = 0; z < edge; ++z) volume.labels.at({x, y, z}) = inside(Vec3(x, y, z)) ? 1 : 0;
  return volume;
}

// Root mean square of (S - true distance) in voxels, over samples within two voxels of the surface and at least
// `margin` from the box's faces.
double surface_error(const LabelVolume& volume, const SmoothingParams& params,
                     const std::function<double(const Vec3&)>& distance, int margin) {
  const auto field = smooth_labels(volume, params, keep_going);
  const auto surface = signed_distance_mm(*field, 0.0f, 1.0, keep_going);
  double sum = 0;
  int count = 0;
  const CoordBox inner = volume.labels.box.grown(-margin);
  for (int x = inner.min.x; x <= inner.max.x; ++x)
    for (int y = inner.min.y; y <= inner.max.y; ++y)
      for (int z = inner.min.z; z <= inner.max.z; ++z) {
        const double truth = distance(Vec3(x, y, z));
        if (std::abs(truth) > 2.0) continue;
        const double off = static_cast<double>(surface->at({x, y, z})) - truth;
        sum += off * off;
        ++count;
      }
  return std::sqrt(sum / count);
}

constexpr SmoothingParams kNone{.rounds = 0};

TEST(LabelVolume, ABallComesOutRound) {
  const auto distance = [](const Vec3& p) { return (p - Vec3(20.3, 20.1, 19.8)).norm() - 14.0; };
  const auto ball = labelled(41, [&](const Vec3& p) { return distance(p) < 0.0; });
  // Steps of one voxel, uniformly distributed over half a voxel to both sides, have 1/sqrt(12) = 0.29. A third of that
  // is no longer visible.
  EXPECT_LT(surface_error(ball, {}, distance, 2), 0.1);
  EXPECT_LT(surface_error(ball, {}, distance, 2), 0.8 * surface_error(ball, kNone, distance, 2));
}

TEST(LabelVolume, ATiltedPlaneLosesItsSteps) {
  // Steps of one voxel every five voxels: within the filter's reach.
  const Vec3 normal = Vec3(0.2, 0.1, 1.0).normalized();
  const auto distance = [&](const Vec3& p) { return normal.dot(p - Vec3(20.2, 20.3, 20.4)); };
  const auto plane = labelled(41, [&](const Vec3& p) { return distance(p) < 0.0; });
  EXPECT_LT(surface_error(plane, {}, distance, 8), 0.12);
  EXPECT_LT(surface_error(plane, {}, distance, 8), 0.6 * surface_error(plane, kNone, distance, 8));
}

TEST(LabelVolume, EveryVoxelStaysOnItsSide) {
  // A plate of one voxel, a rod of one voxel, a single voxel and a single hole. Plain blurring would lose them.
  const auto thin = labelled(24, [](const Vec3& p) {
    if (p.x() == 4.0) return true;
    if (p.y() == 8.0 && p.z() == 8.0) return true;
    if (p == Vec3(16, 16, 16)) return true;
    return p.z() >= 20.0 && p != Vec3(12, 12, 22);
  });
  const auto field = smooth_labels(thin, {}, keep_going);
  ASSERT_TRUE(field);
  for (std::size_t i = 0; i < field->values.size(); ++i)
    ASSERT_EQ(field->values[i] > 0.0f, thin.labels.values[i] != 0) << i;
}

TEST(LabelVolume, ABallKeepsItsVolume) {
  const auto ball = labelled(41, [](const Vec3& p) { return (p - Vec3(20.3, 20.1, 19.8)).norm() < 14.0; });
  const auto field = smooth_labels(ball, {}, keep_going);
  const auto surface = signed_distance_mm(*field, 0.0f, 1.0, keep_going);
  double volume = 0;
  for (const float s : surface->values) volume += std::clamp(0.5 - static_cast<double>(s), 0.0, 1.0);
  double labels = 0;
  for (const std::uint8_t label : ball.labels.values) labels += label;
  EXPECT_NEAR(volume, labels, 0.015 * labels);  // 0.07 voxel less all round; the importer adds this again
}

TEST(LabelVolume, ResamplingKeepsALinearField) {
  DenseVolume<float> field({{0, 0, 0}, {9, 7, 5}}, 0.0f);
  const Vec3 spacing(0.5, 0.75, 1.25);
  const auto value = [](const Vec3& at) { return 1.0 + 2.0 * at.x() - 3.0 * at.y() + 0.5 * at.z(); };
  for (int x = 0; x <= 9; ++x)
    for (int y = 0; y <= 7; ++y)
      for (int z = 0; z <= 5; ++z) field.at({x, y, z}) = static_cast<float>(value(Vec3(x, y, z).cwiseProduct(spacing)));
  const CoordBox box{{1, 1, 1}, {10, 12, 14}};  // within the field: 0.4 mm · 14 < 6.25
  const auto out = resample(field, spacing, box, 0.4, keep_going);
  ASSERT_TRUE(out);
  for (int x = 1; x <= 10; ++x)
    for (int y = 1; y <= 12; ++y)
      for (int z = 1; z <= 14; ++z) EXPECT_NEAR(out->at({x, y, z}), value(position_mm({x, y, z}, 0.4)), 1e-4);
  // Beyond its edge the field continues with the edge's value.
  const auto beyond = resample(field, spacing, {{-9, 0, 0}, {-9, 0, 0}}, 0.4, keep_going);
  EXPECT_EQ(beyond->values[0], field.at({0, 0, 0}));
}

TEST(LabelVolume, DensityReachesTwoVoxelsBeyondTheBone) {
  const auto half = labelled(16, [](const Vec3& p) { return p.x() < 8.0; });
  const float densities[] = {0.0f, 1.5f};
  const auto density = label_density(half, densities, half.labels.box, 1.0, keep_going);
  ASSERT_TRUE(density);
  for (int x = 0; x < 16; ++x) EXPECT_EQ(density->at({x, 5, 11}), x < 10 ? 1.5f : 0.0f) << x;
}

TEST(LabelVolume, TheBoneBoxIsTight) {
  const auto box = bone_voxels(
      labelled(16, [](const Vec3& p) { return p.x() >= 3.0 && p.x() <= 5.0 && p.y() == 7.0 && p.z() <= 2.0; }));
  EXPECT_EQ(box, (CoordBox{{3, 7, 0}, {5, 7, 2}}));
  EXPECT_TRUE(bone_voxels(labelled(4, [](const Vec3&) { return false; })).empty());
}

TEST(LabelVolume, StopsWhenAsked) {
  const auto ball = labelled(16, [](const Vec3& p) { return (p - Vec3(8, 8, 8)).norm() < 4.0; });
  const auto field = smooth_labels(ball, {}, [](double f) { return f < 0.2; });
  ASSERT_FALSE(field);
  EXPECT_EQ(field.error().code, ErrorCode::cancelled);
  // Also at the very end, when all was done before progress was reported again.
  EXPECT_FALSE(smooth_labels(ball, {}, [](double f) { return f < 0.999; }));
}

}  // namespace
}  // namespace osteon::imaging
