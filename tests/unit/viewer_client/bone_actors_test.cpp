// Checks in the pixels how the surface of the bone is drawn.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "common/surface/block_source.hpp"
#include "common/volume/cut_field.hpp"
#include "picture.hpp"
#include "synthetic.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

using test::differing_pixels;
using test::focal_px;
using test::from_front;
using test::kHeight;
using test::kRadius_mm;
using test::kWidth;
using test::on_front;
using test::sphere_mesh;

constexpr RegionKey kHere{BodyId{0}, 0, {0, 0, 0}}, kThere{BodyId{0}, 0, {1, 0, 0}};

class BonePicture : public test::Picture {};

TEST_F(BonePicture, ASphereCoversItsOutline) {
  const Image empty = drawn();
  window_->scene().show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 0));
  const Image image = drawn();
  ASSERT_EQ(image.width_px, kWidth);
  ASSERT_EQ(image.height_px, kHeight);

  // Seen from distance d a sphere's outline is a circle of angle asin(r / d).
  const double radius_px = focal_px(from_front(100.0)) * std::tan(std::asin(15.0 / 100.0));
  const double expected = std::numbers::pi * radius_px * radius_px;
  EXPECT_NEAR(differing_pixels(image, empty), expected, 0.03 * expected);
  for (const auto& [x, y] : {std::pair{2, 2}, {kWidth - 3, 2}, {2, kHeight - 3}, {kWidth - 3, kHeight - 3}}) {
    EXPECT_EQ(image.at(x, y), empty.at(x, y));
  }
  // Bone is bright against the background, and of a warm colour: red over blue.
  const Vec3 middle = colour(image, kWidth / 2, kHeight / 2);
  EXPECT_GT(middle.sum(), colour(empty, kWidth / 2, kHeight / 2).sum() + 200.0);
  EXPECT_GT(middle.x(), middle.z() + 10.0);
}

TEST_F(BonePicture, WhatIsRemovedLeavesBackground) {
  const Image empty = drawn();
  window_->scene().show_region(kHere, sphere_mesh(Vec3(-15, 0, 0), 8.0, 0));
  const Image one = drawn();
  window_->scene().show_region(kThere, sphere_mesh(Vec3(15, 0, 0), 8.0, 0));
  EXPECT_GT(differing_pixels(drawn(), one), 500);
  window_->scene().show_region(kThere, {});
  EXPECT_EQ(differing_pixels(drawn(), one), 0);
  window_->scene().show_region(kHere, {});
  EXPECT_EQ(differing_pixels(drawn(), empty), 0);
}

TEST_F(BonePicture, CutFacesAreRedder) {
  window_->scene().show_region(kHere, sphere_mesh(Vec3(-15, 0, 0), 10.0, 0));
  window_->scene().show_region(kThere, sphere_mesh(Vec3(15, 0, 0), 10.0, 1));
  const Image image = drawn();
  const int offset = static_cast<int>(focal_px(from_front(100.0)) * 15.0 / 100.0);
  const Vec3 imported = colour(image, kWidth / 2 - offset, kHeight / 2);
  const Vec3 cut = colour(image, kWidth / 2 + offset, kHeight / 2);
  EXPECT_GT(cut.x() / cut.y(), 1.25 * imported.x() / imported.y());
}

// A block of bone with a rod of metal and a cap of enamel, and a groove through all of the bone between them. It is
// encoded, decoded and drawn.
TEST_F(BonePicture, MetalAndEnamelHaveColoursOfTheirOwn) {
  const auto tissue = [](const Vec3& p) {
    if (std::hypot(p.x() - 8.0, p.z() + 6.0) < 3.0) return Tissue::metal;
    return p.x() < -6.0 ? Tissue::enamel : Tissue::none;
  };
  CutField field(test::marked_block(28.0, 12.0, 0.5, tissue), BodyId{});
  SurfaceBlocks blocks{BodyId{}};
  // Along the front face, into the enamel and the bone, short of the rod.
  const Cut groove = test::straight_cut(*find_tool("burr-round-5"), {-12, -15.5, -8.5}, {-1, -15.5, -8.5}, {0, 0, -1});
  (void)blocks.touch(groove.level, field.apply(groove).changed_leaves);
  std::vector<BlockKey> keys = blocks.fine_blocks();
  const CoordBox b = field.bone().bounds_samples();
  for (int x = (b.min.x - 1) >> 4; x <= b.max.x >> 4; ++x)
    for (int y = (b.min.y - 1) >> 4; y <= b.max.y >> 4; ++y)
      for (int z = (b.min.z - 1) >> 4; z <= b.max.z >> 4; ++z) keys.push_back({{}, 0, {x, y, z}});
  int region = 0;
  for (const BlockKey& key : keys) {
    BlockSamples samples;
    gather_block(field, blocks, key, 0.5, samples);
    const auto mesh = decode_block(key, encode_block(samples), level_pitch_mm(0.5, key.level));
    ASSERT_TRUE(mesh);
    window_->scene().show_region({BodyId{0}, 0, {region++, 0, 0}}, *mesh);
  }
  CameraView view = from_front(90.0);
  view.target_mm = Vec3(0, -14, -6);
  view.eye_mm = Vec3(0, -90, -6);
  window_->scene().look(view);
  const Image image = drawn();
  if (const char* folder = std::getenv("OSTEON_PICTURES")) {
    ASSERT_TRUE(window_->scene().save_png(std::string(folder) + "/metal.png"));
  }
  const double px_per_mm = focal_px(view) / 76.0;
  const auto seen = [&](double x_mm, double z_mm) {
    return colour(image, kWidth / 2 + static_cast<int>(std::lround(px_per_mm * x_mm)),
                  kHeight / 2 - static_cast<int>(std::lround(px_per_mm * (z_mm + 6.0))));
  };
  const Vec3 bone = seen(2.0, -2.0), metal = seen(8.0, -6.0), enamel = seen(-10.0, -2.0), cut_bone = seen(-3.0, -6.0),
             cut_enamel = seen(-10.0, -6.0);
  EXPECT_GT(bone.x(), bone.z() + 10.0) << "warm";
  EXPECT_GT(metal.z(), metal.x() + 10.0) << "cold";
  EXPECT_NEAR(enamel.x(), enamel.z(), 20.0) << "white";
  EXPECT_GT(enamel.minCoeff(), bone.z() + 10.0);
  EXPECT_GT(cut_bone.x() / cut_bone.y(), 1.25 * bone.x() / bone.y());
  EXPECT_GT((cut_enamel - cut_bone).norm(), 40.0);
  EXPECT_GT((cut_enamel - enamel).norm(), 12.0);
}

// Density from `left` to `right` of the bone's middle plane.
std::shared_ptr<const DensityGrid> two_halves(double left_g_cm3, double right_g_cm3) {
  auto grid = std::make_shared<DensityGrid>(1.0);
  for (int x = -3; x < 3; ++x)
    for (int y = -3; y < 3; ++y)
      for (int z = -3; z < 3; ++z) {
        DensityLeaf leaf;
        leaf.fill(static_cast<std::uint8_t>(std::lround((x < 0 ? left_g_cm3 : right_g_cm3) / kDensityStep_g_cm3)));
        grid->add({x, y, z}, leaf);
      }
  return grid;
}

// Mean brightness of green over a part of the ball's front, and how rough it is: the light changes evenly over a ball,
// so what is left of the second differences is texture.
struct Texture {
  double mean = 0, roughness = 0;
};
Texture texture_of_front(const Image& image, int from_x, int to_x) {
  Texture look;
  int count = 0;
  for (int x = from_x; x < to_x; ++x)
    for (int y = kHeight / 2 - 25; y < kHeight / 2 + 25; ++y, ++count) {
      const double green = image.at(x, y)[1];
      look.mean += green;
      look.roughness += std::abs(2.0 * green - image.at(x, y - 3)[1] - image.at(x, y + 3)[1]);
    }
  return {look.mean / count, look.roughness / count};
}

TEST_F(BonePicture, ACutFaceIsPaleInCortexAndPorousInCancellousBone) {
  const int middle = kWidth / 2;
  const auto drawn_with = [&](double left_g_cm3, double right_g_cm3) {
    window_->scene().set_density(two_halves(left_g_cm3, right_g_cm3));
    window_->scene().show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 1, 120));
    return drawn();
  };
  const Image image = drawn_with(1.9, 0.4);
  if (const char* folder = std::getenv("OSTEON_PICTURES")) {
    ASSERT_TRUE(window_->scene().save_png(std::string(folder) + "/cut-faces.png"));
  }
  const Texture cortex = texture_of_front(image, middle - 28, middle - 6),
                spongy = texture_of_front(image, middle + 6, middle + 28);
  EXPECT_GT(cortex.mean, spongy.mean + 40.0);
  EXPECT_GT(spongy.roughness, 3.0 * cortex.roughness);
  // The less bone, the more pores.
  double brighter = 0.0;
  for (const double g_cm3 : {0.1, 0.3, 0.5, 0.8, 1.1, 1.6}) {
    const Texture now = texture_of_front(drawn_with(g_cm3, g_cm3), middle - 28, middle + 28);
    EXPECT_GT(now.mean, brighter) << g_cm3;
    brighter = now.mean;
  }
}

// Marrow of adult limbs is yellow and brown, and no blood is simulated. So a cut face is warmer and darker than the
// outer face, and not red: blood and muscle have more than twice as much red as green.
TEST_F(BonePicture, ACutFaceThroughCancellousBoneIsBrownAndNotRed) {
  const auto mean_colour = [&](std::uint8_t cut) {
    window_->scene().show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, cut, 120));
    const Image image = drawn();
    Vec3 sum = Vec3::Zero();
    for (int x = -25; x < 25; ++x)
      for (int y = -25; y < 25; ++y) sum += colour(image, kWidth / 2 + x, kHeight / 2 + y);
    return Vec3(sum / (50.0 * 50.0));
  };
  const Vec3 outer = mean_colour(0);
  for (const double g_cm3 : {0.1, 0.2, 0.3, 0.5, 0.7}) {
    window_->scene().set_density(two_halves(g_cm3, g_cm3));
    const Vec3 cut = mean_colour(1);
    EXPECT_LT(cut.x() / cut.y(), 1.7) << g_cm3;
    EXPECT_GT(cut.x() / cut.y(), 1.15 * outer.x() / outer.y()) << g_cm3;
    EXPECT_GT((outer - cut).norm(), 60.0) << g_cm3;
  }
}

// Pores stay where they are in the bone, whatever the triangles are.
TEST_F(BonePicture, TheTextureOfACutIsFixedInTheBone) {
  window_->scene().set_density(two_halves(0.5, 0.5));
  window_->scene().show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 1, 120));
  const Image one = drawn();
  window_->scene().show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 1, 150));
  const Image other = drawn();
  double same = 0.0, shifted = 0.0;
  for (int x = kWidth / 2 - 25; x < kWidth / 2 + 25; ++x)
    for (int y = kHeight / 2 - 25; y < kHeight / 2 + 25; ++y) {
      same += std::abs(one.at(x, y)[1] - other.at(x, y)[1]);
      shifted += std::abs(one.at(x, y)[1] - other.at(x + 7, y)[1]);
    }
  EXPECT_LT(same, 0.4 * shifted);
}

// What is not cut has no texture, and metal keeps its colour.
TEST_F(BonePicture, DensityPaintsOnlyCutBone) {
  window_->scene().show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 0));
  const Image whole = drawn();
  window_->scene().set_density(two_halves(0.4, 0.4));
  window_->scene().show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 0));
  EXPECT_EQ(differing_pixels(drawn(), whole), 0);
}

// The bone around a groove, whose blocks are finer than the bone's, keeps its own colour: to a cell of the bone beside
// the groove, no pixel has that of the cut.
TEST_F(BonePicture, NoPixelOffTheCutHasItsColour) {
  constexpr double kPitch = 0.8;
  for (const int level : {1, 2}) {
    CutField field(test::make_bone(
                       {Vec3::Constant(-15), Vec3::Constant(15)}, kPitch, [](const Vec3& p) { return p.norm() - 12.0; },
                       [](const Vec3&) { return 1.9; }),
                   BodyId{});
    SurfaceBlocks blocks{BodyId{}};
    const Vec3 from(-3, -11, 0), to(3, -11, 1), axis(0, 1, 0);
    Cut groove = test::straight_cut(*find_tool("burr-round-5"), from, to, axis);
    groove.level = level;
    (void)blocks.touch(level, field.apply(groove).changed_leaves);
    std::vector<BlockKey> keys = blocks.fine_blocks();
    for (int x = -2; x <= 1; ++x)
      for (int y = -2; y <= 1; ++y)
        for (int z = -2; z <= 1; ++z) keys.push_back({{}, 0, {x, y, z}});
    int region = 0;
    for (const BlockKey& key : keys) {
      BlockSamples samples;
      gather_block(field, blocks, key, kPitch, samples);
      const auto mesh = decode_block(key, encode_block(samples), level_pitch_mm(kPitch, key.level));
      ASSERT_TRUE(mesh);
      window_->scene().show_region({BodyId{0}, 0, {region++, 0, 0}}, *mesh);
    }
    int on_cut = 0, off_cut = 0;
    for (const Vec3& eye : {Vec3(0, -90, 0), Vec3(50, -70, 20), Vec3(-40, -70, -50)}) {
      CameraView view = from_front(90.0);
      view.eye_mm = eye;
      window_->scene().look(view);
      const Image image = drawn();
      for (int x = 0; x < kWidth; x += 2)
        for (int y = 0; y < kHeight; y += 2) {
          const auto& [r, g, b] = image.at(x, y);
          // Bone has 1.07 times as much red as green, a cut 1.53 times.
          if (r < 60 || r < 1.25 * g) continue;
          // At an edge a pixel may show what the next one is at.
          double least = 1e9;
          for (int dx = -1; dx <= 1; ++dx)
            for (int dy = -1; dy <= 1; ++dy) {
              const auto at = window_->scene().surface_at(x + dx, y + dy);
              if (!at) continue;
              const Vec3 centre = *at + 2.5 * axis - from, along = to - from;
              least = std::min(least,
                               (centre - std::clamp(centre.dot(along) / along.squaredNorm(), 0.0, 1.0) * along).norm());
            }
          ++(least < 2.5 + kPitch ? on_cut : off_cut);
          if (least >= 2.5 + kPitch)
            ADD_FAILURE() << x << ", " << y << ": " << least << " mm, red " << r << " of " << g;
        }
    }
    EXPECT_GT(on_cut, 300) << level;
    EXPECT_EQ(off_cut, 0) << level;
  }
}

TEST_F(BonePicture, DoesNotDependOnTheOrderOfArrival) {
  // Two spheres of different colour at one position: the depth test cannot decide between them.
  window_->scene().show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 0));
  window_->scene().show_region(kThere, sphere_mesh(Vec3::Zero(), 15.0, 1));
  const Image forwards = drawn();
  window_->scene().show_region(kHere, {});
  window_->scene().show_region(kThere, {});
  window_->scene().show_region(kThere, sphere_mesh(Vec3::Zero(), 15.0, 1));
  window_->scene().show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 0));
  EXPECT_EQ(differing_pixels(drawn(), forwards), 0);
}

class SpherePicture : public test::SpherePicture {};

TEST_F(SpherePicture, TheSurfaceUnderAPixelIsTheBonesNotTheTools) {
  CuttingState state;
  state.author = AuthorId{7};
  state.tool_name = "burr-round-5";
  state.pose_bone_tool = state.pose_bone_device = pose_along(Vec3(0, -20, 0), -Vec3::UnitZ());
  window_->scene().show_tools(std::span(&state, 1));
  (void)drawn();
  for (const Vec3& point : {on_front(0.0, 0.0), on_front(0.5, 0.4), on_front(-0.6, -0.3)}) {
    const auto [x, y] = seen(point);
    const auto at = window_->scene().surface_at(x, y);
    ASSERT_TRUE(at);
    // A pixel is 0.2 mm here. Facets lie up to 0.1 mm inside the sphere, more where the view is along the surface.
    EXPECT_LT((*at - point).norm(), 0.6) << at->transpose();
    EXPECT_NEAR(at->norm(), kRadius_mm, 0.1);
  }
  EXPECT_FALSE(window_->scene().surface_at(3, 3));
}

}  // namespace
}  // namespace osteon
