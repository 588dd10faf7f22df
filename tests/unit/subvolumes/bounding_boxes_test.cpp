// Object box and section boxes against their definitions, evaluated voxel by voxel and division by division.
#include "common/subvolumes/bounding_boxes.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/trials.hpp"
#include "tests/unit/subvolumes/scenes.hpp"

namespace osteon::subvolumes {
namespace {

TEST(BoundingBoxes, AreTight) {
  for (std::uint32_t seed = 0; seed < test::trials(200); ++seed) {
    const Scene scene = random_scene(seed);
    const auto slices = slice_boxes(scene.voxels(), always);
    ASSERT_TRUE(slices);
    CoordBox all;
    std::vector<CoordBox> expected(slices->size());
    for_each_voxel(scene.voxels().box(), [&](Coord at) {
      if (scene.bone[scene.voxels().index(at)] == 0) return;
      CoordBox& box = expected[to_index(at.z)];
      box = box.empty() ? CoordBox{at, at} : box_around(box, {at, at});
      all = all.empty() ? CoordBox{at, at} : box_around(all, {at, at});
    });
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ((*slices)[i].empty(), expected[i].empty());
      EXPECT_TRUE(expected[i].empty() || (*slices)[i] == expected[i]) << seed;
    }
    EXPECT_EQ(object_box(*slices), all);
  }
}

TEST(BoundingBoxes, NoBoneHasNoBox) {
  const Scene scene = scene_of({3, 4, 5}, Vec3::Ones(), [](Coord) { return false; });
  const auto slices = slice_boxes(scene.voxels(), always);
  ASSERT_TRUE(slices);
  EXPECT_TRUE(object_box(*slices).empty());
  EXPECT_TRUE(section_boxes(*slices).empty());
}

TEST(BoundingBoxes, StopWhenAsked) {
  const auto slices = slice_boxes(random_scene(1).voxels(), [](double) { return false; });
  ASSERT_FALSE(slices);
  EXPECT_EQ(slices.error().code, ErrorCode::cancelled);
}

// The price of a division whose sections end after the slices that `ends` has a bit for; nothing if a section would
// have a slice without bone.
std::optional<std::int64_t> price_of(const std::vector<CoordBox>& slices, std::uint32_t ends) {
  std::int64_t price = 0;
  CoordBox section;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    if (slices[i].empty()) {
      if (!section.empty()) return {};
      continue;
    }
    section = box_around(section, slices[i]);
    if ((ends >> i & 1U) == 0 && i + 1 < slices.size()) continue;
    const Coord d = section.dims();
    price += std::int64_t{d.x} * d.y * (d.z + 1);
    section = {};
  }
  return price;
}

TEST(Sections, CostTheLeastOfAllDivisions) {
  for (std::uint32_t seed = 0; seed < test::trials(400); ++seed) {
    std::mt19937 random(seed);
    const auto below = [&](std::uint32_t n) { return static_cast<int>(random() % n); };
    std::vector<CoordBox> slices;
    for (int z = 0, count = 1 + below(11); z < count; ++z) {
      const int x = below(6), y = below(6);
      slices.push_back(below(7) == 0 ? CoordBox{} : CoordBox{{x, y, z}, {x + below(9), y + below(9), z}});
    }
    auto least = std::numeric_limits<std::int64_t>::max();
    for (std::uint32_t ends = 0; ends < 1U << slices.size(); ++ends)
      least = std::min(least, price_of(slices, ends).value_or(least));
    EXPECT_EQ(section_cost(section_boxes(slices)), least) << seed;
  }
}

TEST(Sections, HaveEachVoxelOfBoneOnce) {
  for (std::uint32_t seed = 0; seed < test::trials(200); ++seed) {
    const Scene scene = random_scene(seed);
    const std::vector<CoordBox> sections = scene.sections();
    for_each_voxel(scene.voxels().box(), [&](Coord at) {
      const auto having = std::ranges::count_if(sections, [&](const CoordBox& box) { return box.contains(at); });
      EXPECT_TRUE(having == 1 || (having == 0 && scene.bone[scene.voxels().index(at)] == 0)) << seed;
    });
    // None of them has a slice or a margin without bone.
    for (const CoordBox& box : sections) EXPECT_FALSE(box.empty());
  }
}

TEST(Sections, FollowTheSteps) {
  // A thin shaft on a wide foot: one section each, and the border where the step is.
  const Scene scene = scene_of({40, 40, 30}, Vec3::Ones(), [](Coord at) {
    const int half = at.z < 10 ? 15 : 4;
    return std::abs(at.x - 20) <= half && std::abs(at.y - 20) <= half;
  });
  const std::vector<CoordBox> sections = scene.sections();
  ASSERT_EQ(sections.size(), 2u);
  EXPECT_EQ(sections[0], (CoordBox{{5, 5, 0}, {35, 35, 9}}));
  EXPECT_EQ(sections[1], (CoordBox{{16, 16, 10}, {24, 24, 29}}));
}

TEST(Sections, OfAConeAreAsHighAsTheOverlapIsWorth) {
  // The side of a pyramid grows by a voxel a slice. A section of h slices of side s wastes about s h² voxels, and a
  // slice more costs s². So h is about the root of s.
  constexpr int kSlices = 100;
  const Scene scene =
      scene_of({kSlices, kSlices, kSlices}, Vec3::Ones(), [](Coord at) { return at.x <= at.z && at.y <= at.z; });
  const std::vector<CoordBox> sections = scene.sections();
  for (const CoordBox& section : sections) {
    const double height = section.dims().z, expected = std::sqrt(section.dims().x);
    EXPECT_LT(height, 2.0 * expected + 1.0);
    EXPECT_GT(height, 0.4 * expected - 1.0);
  }
}

}  // namespace
}  // namespace osteon::subvolumes
