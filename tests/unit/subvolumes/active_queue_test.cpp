// Cutting sub-volumes and the tree: conservation of bone, and the definition of each kind of voxel.
#include "common/subvolumes/active_queue.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "common/subvolumes/leaf_tree.hpp"
#include "tests/support/trials.hpp"
#include "tests/unit/subvolumes/list_checks.hpp"

namespace osteon::subvolumes {
namespace {

PlacedTool ball_at(const Vec3& centre_mm, double radius_mm) { return {ball(Vec3::Zero(), radius_mm), Pose{centre_mm}}; }

// A box that is longer than wide, so that its place in the world's axes matters.
PlacedTool turned_box(std::mt19937& random, const Scene& scene) {
  const auto length = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto& dims = scene.geometry.dims;
  const Vec3 at(length(-2.0, dims[0] + 1.0), length(-2.0, dims[1] + 1.0), length(-2.0, dims[2] + 1.0));
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(length(0.0, std::numbers::pi),
                                                  Vec3(length(-1, 1), length(-1, 1), length(0.1, 1)).normalized()));
  return {cuboid({Vec3(-0.6, -1.5, -4.0), Vec3(0.6, 1.5, 0.0)}), {scene.geometry.position_mm(at), turn}};
}

// Removes what the tool has of the scene, and counts it.
std::int64_t remove_from(Scene& scene, const PlacedTool& tool) {
  std::int64_t removed = 0;
  for_each_voxel(scene.voxels().box(), [&](Coord at) {
    const Vec3 position = scene.geometry.position_mm(Vec3(at.x, at.y, at.z));
    if (tool.solid(tool.pose_bone_tool.inverse().point(position)) > 0.0) return;
    std::uint8_t& bone = scene.bone[scene.voxels().index(at)];
    removed += std::exchange(bone, std::uint8_t{0});
  });
  return removed;
}

TEST(ActiveQueue, RemovesWhatTheToolHas) {
  for (std::uint32_t seed = 0; seed < test::trials(160); ++seed) {
    Scene scene = random_scene(seed);
    const Scene whole = scene;  // what the tree was made of
    std::mt19937 random(seed);
    auto list = SubVolumeList::divide(scene.voxels(), scene.sections(), 3, always);
    auto tree = LeafTree::build(whole.voxels(), object_box(*slice_boxes(whole.voxels(), always)), always);
    ASSERT_TRUE(list && tree);
    for (int cuts = 0; cuts < 4; ++cuts) {
      const PlacedTool tool = turned_box(random, scene);
      const std::int64_t before = list->bone();
      const auto parts = static_cast<std::int64_t>(list->all().size());
      const ActiveStep step = cut(*list, tool, scene.geometry);
      const LeafStep leaves = tree->cut(tool);
      const std::int64_t removed = remove_from(scene, tool);
      EXPECT_EQ(step.walk.removed, removed) << seed;
      EXPECT_EQ(leaves.walk.removed, removed) << seed;
      EXPECT_EQ(list->bone(), before - removed);
      EXPECT_EQ(tree->bone(), before - removed);
      // A divided sub-volume gives way to what is made of it, so there is one less for each that is divided or emptied.
      EXPECT_LE(static_cast<std::int64_t>(list->all().size()), parts + step.made);
      EXPECT_GE(step.queued, removed > 0 ? 1 : 0);
      expect_partition(*list, scene, 3);
    }
  }
}

TEST(ActiveQueue, CountsVoxelsByTheirDefinition) {
  for (std::uint32_t seed = 0; seed < test::trials(160); ++seed) {
    const Scene scene = random_scene(seed);
    std::mt19937 random(seed + 1000);
    const PlacedTool tool = turned_box(random, scene);
    auto list = SubVolumeList::divide(scene.voxels(), scene.sections(), 2, always);
    ASSERT_TRUE(list);
    const CoordBox block = world_block(tool, scene.geometry);
    WalkCounts expected;
    std::int64_t queued = 0;
    for (const SubVolume& part : list->all()) {
      bool active = false;
      for_each_voxel(part.box, [&](Coord at) {
        const Vec3 local = tool.pose_bone_tool.inverse().point(scene.geometry.position_mm(Vec3(at.x, at.y, at.z)));
        const Box& bounds = tool.solid.bounds;
        const bool in_box =
            (local.array() >= bounds.min_mm.array()).all() && (local.array() <= bounds.max_mm.array()).all();
        EXPECT_TRUE(block.contains(at) || !in_box) << "the world's block has the local one";
        if (!block.contains(at)) return;
        active = true;
        const bool inside = in_box && tool.solid(local) <= 0.0;
        expected.visited += !in_box;
        expected.computed += in_box && !inside;
        expected.modified += inside;
        expected.removed += inside && part.is_bone[part.index(at)] != 0;
      });
      queued += active;
    }
    const ActiveStep step = cut(*list, tool, scene.geometry);
    EXPECT_EQ(step.walk, expected) << seed;
    EXPECT_EQ(step.queued, queued) << seed;
  }
}

TEST(ActiveQueue, DividesOnlyWhereTheToolIs) {
  // A full block is one sub-volume, however often it may be divided. A tool at its first corner divides it three times.
  // Each time three quadrants stay full, and the last time the fourth one gets a hole.
  Scene scene = scene_of({32, 32, 4}, Vec3::Ones(), [](Coord) { return true; });
  auto list = SubVolumeList::divide(scene.voxels(), scene.sections(), 3, always);
  ASSERT_TRUE(list);
  ASSERT_EQ(list->all().size(), 1u);
  EXPECT_EQ(list->all().front().level, 0);
  const PlacedTool tool = ball_at(scene.geometry.origin_mm, 1.5);
  const ActiveStep step = cut(*list, tool, scene.geometry);
  EXPECT_EQ(step.queued, 1);
  EXPECT_EQ(step.emptied, 0);
  EXPECT_EQ(list->all().size(), 10u);  // 3 + 3 + 3 full, 1 partly full
  EXPECT_EQ(step.made, 12);            // four quadrants, three times
  EXPECT_EQ(std::ranges::count(list->all(), Fill::full, &SubVolume::fill), 9);
  EXPECT_EQ(step.walk.removed, remove_from(scene, tool));
  expect_partition(*list, scene, 3);
  // Again there: nothing is left to remove, so nothing is divided.
  const ActiveStep again = cut(*list, tool, scene.geometry);
  EXPECT_EQ(again.walk.removed, 0);
  EXPECT_EQ(again.walk.modified, step.walk.modified);
  EXPECT_EQ(again.made, 0);
  EXPECT_EQ(list->all().size(), 10u);
}

TEST(ActiveQueue, RemovesSubVolumesUntilNoneIsLeft) {
  const Scene scene = scene_of({24, 20, 6}, Vec3(0.5, 0.5, 1.0), [](Coord at) { return (at.x + at.y) % 5 != 0; });
  auto list = SubVolumeList::divide(scene.voxels(), scene.sections(), 2, always);
  auto tree = LeafTree::build(scene.voxels(), scene.voxels().box(), always);
  ASSERT_TRUE(list && tree);
  const auto parts = static_cast<std::int64_t>(list->all().size());
  std::int64_t emptied = 0, removed = 0, leaves_emptied = 0;
  const auto leaves = static_cast<std::int64_t>(tree->leaves());
  std::size_t memory = list->memory_bytes();
  for (int x = -4; x <= 16; ++x) {
    const PlacedTool tool = ball_at(scene.geometry.origin_mm + Vec3(x, 5.0, 3.0), 9.0);
    const ActiveStep step = cut(*list, tool, scene.geometry);
    emptied += step.emptied;
    removed += step.walk.removed;
    leaves_emptied += tree->cut(tool).emptied;
    EXPECT_LE(list->memory_bytes(), memory);
    memory = list->memory_bytes();
  }
  EXPECT_EQ(removed, scene.bones());
  EXPECT_EQ(emptied, parts);  // all were partly full and of the last level
  EXPECT_TRUE(list->all().empty());
  EXPECT_EQ(list->memory_bytes(), 0u);
  EXPECT_EQ(leaves_emptied, leaves);
  EXPECT_EQ(tree->leaves(), 0u);
}

TEST(ActiveQueue, ATouchedEdgeHasTwoOfThem) {
  const Scene scene = scene_of({32, 32, 4}, Vec3::Ones(), [](Coord at) { return (at.x + at.y) % 2 == 0; });
  auto list = SubVolumeList::divide(scene.voxels(), scene.sections(), 1, always);
  ASSERT_TRUE(list);
  ASSERT_EQ(list->all().size(), 4u);
  const auto queued = [&](double x, double y) {
    SubVolumeList copy = *list;
    return cut(copy, ball_at(scene.geometry.position_mm(Vec3(x, y, 2)), 2.0), scene.geometry).queued;
  };
  EXPECT_EQ(queued(8, 8), 1);     // Niu 2008, figure 5.7: within one
  EXPECT_EQ(queued(15.5, 8), 2);  // on a face
  EXPECT_EQ(queued(15.5, 15.5), 4);
  EXPECT_EQ(queued(100, 8), 0);
}

TEST(ActiveQueue, AToolFarAwayMeetsNothing) {
  const Scene scene = random_scene(2);
  auto list = SubVolumeList::divide(scene.voxels(), scene.sections(), 3, always);
  ASSERT_TRUE(list);
  for (const double far : {1e6, 1e12, 1e300})
    EXPECT_EQ(cut(*list, ball_at(Vec3(far, -far, far), 2.0), scene.geometry).queued, 0);
}

}  // namespace
}  // namespace osteon::subvolumes
