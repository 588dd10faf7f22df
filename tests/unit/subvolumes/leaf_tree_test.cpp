// The tree has the bone of the scan, and no more leaves than bone needs.
#include "common/subvolumes/leaf_tree.hpp"

#include <gtest/gtest.h>

#include <set>

#include "common/subvolumes/voxel_surface.hpp"
#include "tests/support/trials.hpp"
#include "tests/unit/subvolumes/scenes.hpp"

namespace osteon::subvolumes {
namespace {

TEST(LeafTree, HasTheBoneOfTheScan) {
  for (std::uint32_t seed = 0; seed < test::trials(160); ++seed) {
    const Scene scene = random_scene(seed);
    const BoneVoxels voxels = scene.voxels();
    const auto tree = LeafTree::build(voxels, object_box(*slice_boxes(voxels, always)), always);
    ASSERT_TRUE(tree);
    EXPECT_EQ(tree->bone(), scene.bones()) << seed;
    EXPECT_EQ(tree->bone_in(voxels.box()), scene.bone) << seed;
    std::set<Coord> leaves;
    for_each_voxel(voxels.box(), [&](Coord at) {
      if (scene.bone[voxels.index(at)] != 0) leaves.insert(floor_to(at, kLeafSize));
    });
    EXPECT_EQ(tree->leaves(), leaves.size()) << seed;
    EXPECT_GE(tree->memory_bytes(), leaves.size() * kLeafVoxels * sizeof(float));
  }
}

TEST(LeafTree, HasTheSurfaceOfTheScan) {
  for (std::uint32_t seed = 0; seed < test::trials(80); ++seed) {
    const Scene scene = random_scene(seed);
    const BoneVoxels voxels = scene.voxels();
    const auto tree = LeafTree::build(voxels, voxels.box(), always);
    ASSERT_TRUE(tree);
    const auto mesh = tree->reconstruct(always);
    const auto whole = reconstruct(voxels, std::array{voxels.box().grown(1)}, always);
    ASSERT_TRUE(mesh && whole);
    // The same cells. A leaf that is not there gives air, so points may lie elsewhere on their edges.
    EXPECT_EQ(mesh->triangles.size(), whole->triangles.size()) << seed;
  }
}

TEST(LeafTree, StopsWhenAsked) {
  const Scene scene = random_scene(6);
  const auto no = [](double) { return false; };
  const auto tree = LeafTree::build(scene.voxels(), scene.voxels().box(), no);
  ASSERT_FALSE(tree);
  EXPECT_EQ(tree.error().code, ErrorCode::cancelled);
  const auto whole = LeafTree::build(scene.voxels(), scene.voxels().box(), always);
  ASSERT_TRUE(whole);
  EXPECT_FALSE(whole->reconstruct(no));
}

}  // namespace
}  // namespace osteon::subvolumes
