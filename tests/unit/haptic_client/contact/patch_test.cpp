// A patch feels like the bone from which it was made.
#include "haptic_client/contact/patch_builder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/scenes/random_cuts.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

Cut hole(double depth_mm) {
  const Tool tool = *find_tool("drill-3.2");
  Cut cut;
  cut.author = AuthorId{1};
  cut.author_seq = 1;
  cut.tool = tool.hash();
  cut.level = tool.cut_level;
  cut.path = {quantise(pose_along({0, 0, -1}, Vec3::UnitZ())), quantise(pose_along({0, 0, depth_mm}, Vec3::UnitZ()))};
  return cut;
}

TEST(Patch, AgreesWithTheFieldRoundTheTool) {
  const Case bone = block_case();
  CutField field(bone, BodyId{});
  field.apply(hole(4.0));
  const ToolModel model(*find_tool("drill-3.2"), bone.pitch_mm());
  PatchBuilder builder;
  Patch patch;
  const Pose pose{{0, 0, 4.0}, Eigen::Quaterniond::Identity()};
  builder.build(field, model, pose, patch);

  std::mt19937 random(7);
  std::uniform_real_distribution<double> side(-2.4, 2.4), deep(-3.0, 5.2);
  int fine = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 p(side(random), side(random), deep(random));
    const double expected = field.solid_mm(p);
    double value = 0.0;
    if (std::abs(signed_distance_mm(model.tool, pose.inverse().point(p))) > 1.0) continue;
    ASSERT_TRUE(patch.solid(p, value));
    double unused = 0.0;
    fine += patch.fine.sample(p, unused);
    // The max of trilinears and the trilinear of maxima differ by less than the pitch over a crease.
    // Deep in bone only the sign matters: values there are clipped, in each level by its own band.
    if (expected > -0.4) {
      EXPECT_NEAR(value, expected, 0.13) << p.transpose();
    } else {
      EXPECT_LT(value, -0.25) << p.transpose();
    }
    EXPECT_NEAR(patch.density_at(p), bone.density_g_cm3(p), 1e-5);
  }
  EXPECT_GT(fine, 500);
}

TEST(Patch, FollowsCutsWithFewNewBricks) {
  const Case bone = block_case();
  CutField field(bone, BodyId{});
  const ToolModel model(*find_tool("drill-3.2"), bone.pitch_mm());
  PatchBuilder builder;
  Patch patch;
  const Pose pose{{0, 0, 1.0}, Eigen::Quaterniond::Identity()};
  builder.build(field, model, pose, patch);
  const std::size_t first = builder.bricks_made();

  const Cut cut = hole(1.0);
  const CutReport report = field.apply(cut);
  builder.changed(bone.pitch_mm(), report.level, report.changed_leaves);
  builder.build(field, model, pose, patch);
  EXPECT_LT(builder.bricks_made() - first, first);
  double value = 0.0;
  ASSERT_TRUE(patch.solid({0, 0, 0.5}, value));
  EXPECT_GT(value, 0.0);

  // Nothing changed, so nothing is made.
  const std::size_t second = builder.bricks_made();
  builder.build(field, model, pose, patch);
  EXPECT_EQ(builder.bricks_made(), second);
}

// Samples of all bricks, and a number that no sample has for each brick that is unknown.
std::vector<float> samples_of(const BrickGrid& grid) {
  std::vector<float> samples;
  const Coord dims = grid.dims();
  for (int i = 0; i < dims.x * dims.y * dims.z; ++i) {
    const float* brick = grid.tables()[i];
    if (brick != nullptr)
      samples.insert(samples.end(), brick, brick + kBrickSamples * kBrickSamples * kBrickSamples);
    else
      samples.push_back(1e9f);
  }
  return samples;
}

// Cuts of each level change samples of each level. Those that a builder keeps are those of one that begins anew.
TEST(Patch, FollowsCutsOfEveryLevelInEverySample) {
  const Case bone = osteon::test::ball_of_bone();
  const Pose pose{{0, 0, -9.0}, Eigen::Quaterniond::Identity()};
  for (int level = 0; level < kLevels; ++level) {
    Tool tool = *find_tool("burr-round-5");
    tool.cut_level = level;
    const ToolModel model(tool, bone.pitch_mm());
    CutField field(bone, BodyId{});
    PatchBuilder builder;
    Patch patch, anew;
    builder.build(field, model, pose, patch);
    osteon::test::Random random(11);
    int i = 0, compared = 0;
    for (Cut& cut : osteon::test::grazing_cuts(100, random)) {
      cut.level = i++ % kLevels;
      const CutReport report = field.apply(cut);
      const std::size_t before = builder.bricks_made();
      builder.changed(bone.pitch_mm(), report.level, report.changed_leaves);
      builder.build(field, model, pose, patch);
      if (builder.bricks_made() == before) continue;
      ++compared;
      PatchBuilder().build(field, model, pose, anew);
      ASSERT_EQ(samples_of(patch.fine), samples_of(anew.fine)) << "level " << level << ", cut " << i;
      ASSERT_EQ(samples_of(patch.coarse), samples_of(anew.coarse)) << "level " << level << ", cut " << i;
    }
    EXPECT_GT(compared, 10) << level;
  }
}

// Whether one of a brick's samples depends on a leaf: it is one of its samples, or lies between two samples of the
// leaf's level, of which one is the leaf's. Counted along one axis in pitches of the finest level.
bool depends(int brick, int of_level, int leaf_origin, int leaf_level) {
  const int step = 1 << (kLevels - 1 - of_level), leaf_step = 1 << (kLevels - 1 - leaf_level);
  const int reach = step < leaf_step ? leaf_step : 1;
  const int after = leaf_origin * leaf_step - reach, before = (leaf_origin + kLeafSize - 1) * leaf_step + reach;
  for (int i = 0; i < kBrickSamples; ++i) {
    const int sample = (brick * kBrickCells + i) * step;
    if (after < sample && sample < before) return true;
  }
  return false;
}

// How many bricks were made anew. Bricks without bone share one, which no leaf changes.
int check_made_anew(const BrickGrid& before, const BrickGrid& after, int of_level, Coord leaf, int leaf_level) {
  int anew = 0, i = 0;
  for (int x = 0; x < after.dims().x; ++x)
    for (int y = 0; y < after.dims().y; ++y)
      for (int z = 0; z < after.dims().z; ++z, ++i) {
        const float* const brick = after.tables()[i];
        if (brick == nullptr) continue;
        const Coord at = after.first() + Coord{x, y, z};
        const bool expected = depends(at.x, of_level, leaf.x, leaf_level) &&
                              depends(at.y, of_level, leaf.y, leaf_level) &&
                              depends(at.z, of_level, leaf.z, leaf_level);
        const bool made = brick != before.tables()[i];
        const bool alike = std::all_of(brick, brick + kBrickSamples * kBrickSamples * kBrickSamples,
                                       [&](float value) { return value == *brick; });
        if (!expected || !alike) EXPECT_EQ(made, expected) << "brick " << at.x << " " << at.y << " " << at.z;
        anew += made;
      }
  return anew;
}

// No brick that depends on a changed leaf is kept, and no other is made anew.
TEST(Patch, MakesOnlyTheBricksOfAChangedLeafAnew) {
  const Case bone = osteon::test::ball_of_bone();
  const Pose pose{{0, 0, -9.0}, Eigen::Quaterniond::Identity()};
  const CutField field(bone, BodyId{});
  for (int level = 0; level < kLevels; ++level)
    for (int leaf_level = 0; leaf_level < kLevels; ++leaf_level) {
      SCOPED_TRACE("tool of level " + std::to_string(level) + ", leaf of level " + std::to_string(leaf_level));
      Tool tool = *find_tool("burr-round-5");
      tool.cut_level = level;
      const ToolModel model(tool, bone.pitch_mm());
      PatchBuilder builder;
      Patch before, after;
      builder.build(field, model, pose, before);
      int anew = 0;
      for (const Vec3& place :
           {Vec3(0.3, 0.4, -9.2), Vec3(-1.1, 0.7, -8.0), Vec3(1.9, -1.3, -9.9), Vec3(0.1, 2.2, -8.6)}) {
        const Vec3 leaf = (place / (kLeafSize * level_pitch_mm(bone.pitch_mm(), leaf_level))).array().floor();
        const Coord origin{kLeafSize * static_cast<int>(leaf.x()), kLeafSize * static_cast<int>(leaf.y()),
                           kLeafSize * static_cast<int>(leaf.z())};
        builder.changed(bone.pitch_mm(), leaf_level, {origin});
        builder.build(field, model, pose, after);
        anew += check_made_anew(before.fine, after.fine, level, origin, leaf_level);
        anew += check_made_anew(before.coarse, after.coarse, 0, origin, leaf_level);
        std::swap(before, after);
      }
      EXPECT_GT(anew, 10);
    }
}

// Two bodies share the block. What is solid in either is solid. A body that goes takes its half with it.
TEST(Patch, HoldsEveryBody) {
  const Case bone = block_case();
  CutField whole(bone, BodyId{}), left(bone, BodyId{}), right(bone, BodyId{1});
  // One body has a hole and the other is whole. Together they are whole.
  left.apply(hole(4.0));
  const ToolModel model(*find_tool("drill-3.2"), bone.pitch_mm());
  const Pose pose{{0, 0, 4.0}, Eigen::Quaterniond::Identity()};
  PatchBuilder builder, other;
  Patch patch, expected;
  const CutField* const both[] = {&left, &right};
  builder.build(both, model, pose, patch);
  other.build(whole, model, pose, expected);
  double value = 0.0, wanted = 0.0;
  for (double z = 0.1; z < 5.0; z += 0.3)
    for (double x = -1.5; x <= 1.5; x += 0.5) {
      ASSERT_TRUE(patch.solid({x, 0, z}, value) && expected.solid({x, 0, z}, wanted));
      EXPECT_NEAR(value, wanted, 1e-6);
    }
  builder.build(std::span(both, 1), model, pose, patch);
  ASSERT_TRUE(patch.solid({0, 0, 2.0}, value));
  EXPECT_GT(value, 0.0);
}

TEST(Patch, KnowsNothingOutside) {
  const Case bone = block_case();
  const CutField field(bone, BodyId{});
  Patch patch;
  double value = 0.0;
  EXPECT_FALSE(patch.solid(Vec3::Zero(), value));
  PatchBuilder().build(field, ToolModel(*find_tool("drill-3.2"), 0.5), {{0, 0, -1}, Eigen::Quaterniond::Identity()},
                       patch);
  EXPECT_TRUE(patch.solid({0, 0, 0}, value));
  EXPECT_FALSE(patch.solid({0, 0, 29}, value));
}

}  // namespace
}  // namespace osteon::haptic::test
