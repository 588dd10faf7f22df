// Distances to structures at risk, compared with closed forms of shapes whose voxels are labelled.
#include "viewer_client/scene/structure_distances.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>

#include "common/surface/label_surface.hpp"

namespace osteon {
namespace {

using Shape = std::function<double(const Vec3&)>;  // signed distance, mm

// A voxel is labelled if its centre is in the shape, as in a phantom and in a label map.
SurgicalPlan::Structure labelled(const VoxelGrid& grid, const Shape& shape) {
  const ReadSlice read = [&](int k, std::span<std::uint8_t> voxels) {
    std::size_t to = 0;
    for (int j = 0; j < grid.dims[1]; ++j)
      for (int i = 0; i < grid.dims[0]; ++i)
        voxels[to++] = shape(grid.origin_mm + grid.axes_mm * Vec3(i, j, k)) < 0.0 ? 1 : 0;
  };
  Result<TriangleMesh> surface = label_surface(grid, read, 1'000'000);
  EXPECT_TRUE(surface);
  return {"shape", StructureKind::vessel, grid.longest_edge_mm(), surface ? *surface : TriangleMesh{}};
}

StructureDistances distances_to(std::vector<SurgicalPlan::Structure> structures) {
  auto plan = std::make_shared<SurgicalPlan>();
  plan->structures = std::move(structures);
  return StructureDistances(plan);
}

VoxelGrid cubes(double edge_mm, int count) {
  VoxelGrid grid;
  grid.dims = {count, count, count};
  grid.axes_mm = edge_mm * Eigen::Matrix3d::Identity();
  grid.origin_mm = Vec3::Constant(-0.5 * edge_mm * (count - 1)) + Vec3(0.11, -0.07, 0.05);
  return grid;
}

// Points on shells about the origin, which no lattice prefers.
std::vector<Vec3> points_around(double least_mm, double most_mm) {
  std::vector<Vec3> points;
  for (int i = 0; i < 400; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / 400.0, turn = 2.399963 * i, r = std::sqrt(1.0 - z * z);
    points.emplace_back((least_mm + (most_mm - least_mm) * (i % 37) / 36.0) *
                        Vec3(r * std::cos(turn), r * std::sin(turn), z));
  }
  return points;
}

// The distance is that of the shape within half a voxel, and 0 in it.
void expect_distances(const StructureDistances& distances, const Shape& shape, const std::vector<Vec3>& points,
                      double voxel_mm) {
  double worst_mm = 0.0;
  int outside = 0, inside = 0;
  for (const Vec3& p : points) {
    const auto found = distances.nearest(p);
    ASSERT_TRUE(found);
    const double expected_mm = shape(p);
    if (std::abs(expected_mm) > 0.5 * voxel_mm) {
      EXPECT_EQ(found->inside, expected_mm < 0.0) << p.transpose();
      ++(expected_mm < 0.0 ? inside : outside);
    }
    worst_mm = std::max(worst_mm, std::abs(found->distance_mm - std::max(0.0, expected_mm)));
    if (!found->inside) {
      EXPECT_NEAR((found->point_mm - p).norm(), found->distance_mm, 1e-6);
      EXPECT_LT(std::abs(shape(found->point_mm)), 0.5 * voxel_mm);
    }
  }
  EXPECT_LE(worst_mm, 0.5 * voxel_mm);
  EXPECT_GT(outside, 100);
  EXPECT_GT(inside, 20);
  testing::Test::RecordProperty("worst_voxels", std::to_string(worst_mm / voxel_mm));
}

TEST(StructureDistances, OfASphereAreThoseOfItsClosedFormWithinHalfAVoxel) {
  for (const double radius_mm : {1.4, 3.0, 8.0}) {
    const Shape ball = [&](const Vec3& p) { return p.norm() - radius_mm; };
    const double edge_mm = 0.6;
    expect_distances(distances_to({labelled(cubes(edge_mm, 40), ball)}), ball, points_around(0.1, 2.5 * radius_mm),
                     edge_mm);
  }
}

// A vessel of 2 mm radius across a scan with thick slices. Its ends are round, as those of a phantom's tube.
TEST(StructureDistances, OfATubeAcrossThickSlicesAreThoseOfItsClosedFormWithinHalfAVoxel) {
  const Vec3 along = Vec3(0.4, 0.3, 1.0).normalized();
  const Shape tube = [&](const Vec3& p) { return (p - std::clamp(p.dot(along), -9.0, 9.0) * along).norm() - 2.0; };
  VoxelGrid grid;
  grid.dims = {60, 60, 24};
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(0.4, Vec3::UnitX()).matrix();
  grid.axes_mm = turned * Vec3(0.4, 0.4, -1.2).asDiagonal();  // slices from the head to the feet
  grid.origin_mm = -grid.axes_mm * Vec3(29.3, 29.6, 11.4);
  expect_distances(distances_to({labelled(grid, tube)}), tube, points_around(0.1, 14.0), grid.longest_edge_mm());
}

TEST(StructureDistances, AThinStructureKeepsItsWidth) {
  // One row of voxels, 0.5 mm wide.
  const VoxelGrid grid = cubes(0.5, 31);
  const Vec3 middle = grid.origin_mm + grid.axes_mm * Vec3(15, 15, 15);
  const SurgicalPlan::Structure row = labelled(
      grid, [&](const Vec3& p) { return std::max(std::abs(p.x() - middle.x()), std::abs(p.y() - middle.y())) - 0.1; });
  const auto found = distances_to({row}).nearest(middle + Vec3(5.0, 0, 0));
  ASSERT_TRUE(found);
  // Half of the row's width is 0.25 mm.
  EXPECT_NEAR(found->distance_mm, 4.75, 0.25);
  EXPECT_LT(found->distance_mm, 5.0 - 0.09);
}

TEST(StructureDistances, TheNearestOfSeveralCountsAndARegionIsNoRisk) {
  const auto ball = [](const Vec3& centre) { return [centre](const Vec3& p) { return (p - centre).norm() - 2.0; }; };
  const VoxelGrid grid = cubes(0.5, 60);
  std::vector<SurgicalPlan::Structure> structures{labelled(grid, ball({-8, 0, 0})), labelled(grid, ball({8, 0, 0})),
                                                  labelled(grid, ball({1, 0, 0}))};
  structures[2].kind = StructureKind::region;
  const StructureDistances distances = distances_to(structures);
  EXPECT_EQ(distances.nearest({-1, 0, 0})->structure, 0u);
  EXPECT_EQ(distances.nearest({1, 0, 0})->structure, 1u);
  EXPECT_NEAR(distances.nearest({1, 0, 0})->distance_mm, 5.0, 0.25);
  EXPECT_FALSE(distances_to({structures[2]}).nearest(Vec3::Zero()));
  EXPECT_FALSE(distances_to({}).nearest(Vec3::Zero()));
}

}  // namespace
}  // namespace osteon
