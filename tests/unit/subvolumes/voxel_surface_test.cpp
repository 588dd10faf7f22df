// The surface of bone: closed forms, and the same surface whether from the scan, the object box or the sections.
#include "common/subvolumes/voxel_surface.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/trials.hpp"
#include "tests/unit/subvolumes/scenes.hpp"

namespace osteon::subvolumes {
namespace {

// HU rise linearly with depth, as partial volumes do, so that interpolation has something to find.
Scene ball_scene(double radius_mm, const Vec3& spacing_mm) {
  const Vec3 middle = Vec3::Constant(radius_mm + 2.0) + Vec3(0.13, 0.21, 0.07);
  const Vec3 size = (Vec3::Constant(2.0 * radius_mm + 4.0)).cwiseQuotient(spacing_mm);
  const auto depth = [&](Coord at) {
    return radius_mm - (spacing_mm.cwiseProduct(Vec3(at.x, at.y, at.z)) - middle).norm();
  };
  Scene scene =
      scene_of({static_cast<int>(size.x()) + 2, static_cast<int>(size.y()) + 2, static_cast<int>(size.z()) + 2},
               spacing_mm, [&](Coord at) { return depth(at) >= 0.0; });
  for_each_voxel(scene.voxels().box(), [&](Coord at) {
    scene.hu[scene.voxels().index(at)] =
        static_cast<std::int16_t>(std::clamp(std::floor(kThreshold_hu + 600.0 * depth(at)), -1000.0, 2000.0));
  });
  return scene;
}

TEST(VoxelSurface, OfABallEnclosesItsVolume) {
  const double radius = 9.0, volume = 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
  double last_error = 1.0;
  for (const double spacing : {2.0, 1.0, 0.5}) {
    const Scene scene = ball_scene(radius, Vec3(spacing, spacing, 1.5 * spacing));
    const auto mesh = reconstruct(scene.voxels(), std::array{scene.voxels().box().grown(1)}, always);
    ASSERT_TRUE(mesh);
    const double error = std::abs(enclosed_mm3(*mesh) / volume - 1.0);
    EXPECT_LT(error, 0.03 * spacing * spacing);
    EXPECT_LT(error, last_error);
    last_error = error;
  }
}

TEST(VoxelSurface, FacesOutwardsInAMirroredScan) {
  Scene scene = ball_scene(6.0, Vec3::Ones());
  const std::array box{scene.voxels().box().grown(1)};
  const auto straight = reconstruct(scene.voxels(), box, always);
  scene.geometry.axes_mm.col(2) *= -1.0;
  const auto mirrored = reconstruct(scene.voxels(), box, always);
  ASSERT_TRUE(straight && mirrored);
  EXPECT_GT(enclosed_mm3(*straight), 0.0);
  EXPECT_NEAR(enclosed_mm3(*mirrored), enclosed_mm3(*straight), 1e-4 * enclosed_mm3(*straight));
}

TEST(VoxelSurface, IsTheSameFromEveryDivision) {
  for (std::uint32_t seed = 0; seed < test::trials(160); ++seed) {
    const Scene scene = random_scene(seed);
    const BoneVoxels voxels = scene.voxels();
    const CoordBox object = object_box(*slice_boxes(voxels, always));
    const auto whole = reconstruct(voxels, std::array{voxels.box().grown(1)}, always);
    const auto of_object = reconstruct(voxels, std::array{object.grown(1)}, always);
    const auto of_sections = reconstruct(voxels, cell_boxes(scene.sections()), always);
    ASSERT_TRUE(whole && of_object && of_sections);
    EXPECT_EQ(of_object->triangles.size(), whole->triangles.size()) << seed;
    EXPECT_EQ(of_sections->triangles.size(), whole->triangles.size()) << seed;
    const double volume = enclosed_mm3(*whole);
    EXPECT_GT(volume, 0.0);
    EXPECT_NEAR(enclosed_mm3(*of_object), volume, 1e-4 * volume) << seed;
    EXPECT_NEAR(enclosed_mm3(*of_sections), volume, 1e-4 * volume) << seed;
  }
}

TEST(VoxelSurface, LeavesOutMarrowAndMetal) {
  Scene scene = ball_scene(8.0, Vec3::Ones());
  const std::array box{scene.voxels().box().grown(1)};
  const auto whole = reconstruct(scene.voxels(), box, always);
  scene.hu[scene.voxels().index({10, 10, 10})] = -50;  // a voxel of marrow in the middle
  scene.hu[scene.voxels().index({0, 0, 0})] = 3000;    // metal in the corner
  const auto again = reconstruct(scene.voxels(), box, always);
  ASSERT_TRUE(whole && again);
  EXPECT_EQ(again->triangles.size(), whole->triangles.size());
}

TEST(VoxelSurface, StopsWhenAsked) {
  const Scene scene = random_scene(4);
  const auto mesh = reconstruct(scene.voxels(), cell_boxes(scene.sections()), [](double) { return false; });
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon::subvolumes
