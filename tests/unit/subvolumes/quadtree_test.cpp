// Quadtree subdivision: exact partitions, closed forms, and the arithmetic of Niu 2008, Table 5.3.
#include "common/subvolumes/quadtree.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/trials.hpp"
#include "tests/unit/subvolumes/scenes.hpp"

namespace osteon::subvolumes {
namespace {

TEST(Quadrants, PartitionABox) {
  for (int columns = 1; columns <= 9; ++columns)
    for (int rows = 1; rows <= 9; ++rows) {
      const CoordBox box{{2, 5, 1}, {1 + columns, 4 + rows, 3}};
      const std::vector<CoordBox> quadrants = quadrants_of(box);
      EXPECT_EQ(quadrants.size(), (columns > 1 ? 2u : 1u) * (rows > 1 ? 2u : 1u));
      std::int64_t sum = 0;
      for (const CoordBox& quadrant : quadrants) {
        sum += voxels_of(quadrant);
        EXPECT_EQ(common_box(quadrant, box), quadrant);
        EXPECT_EQ(quadrant.dims().z, 3);
        EXPECT_LE(std::abs(2 * quadrant.dims().x - columns), 1);  // also for one column, which stays
        EXPECT_LE(std::abs(2 * quadrant.dims().y - rows), 1);
        for (const CoordBox& other : quadrants) EXPECT_TRUE(&other == &quadrant || common_box(quadrant, other).empty());
      }
      EXPECT_EQ(sum, voxels_of(box));
    }
}

TEST(Quadrants, AreAsManyAsTheUniformDivisionHas) {
  for (int columns = 1; columns <= 20; ++columns)
    for (int rows = 1; rows <= 20; ++rows) {
      const CoordBox box{{0, 0, 0}, {columns - 1, rows - 1, 0}};
      std::vector<CoordBox> parts{box};
      for (int n = 0; n <= 6; ++n) {
        EXPECT_EQ(uniform_count(box, n), static_cast<std::int64_t>(parts.size())) << columns << " " << rows << " " << n;
        for (const CoordBox& part : std::exchange(parts, {}))
          for (const CoordBox& quadrant : quadrants_of(part)) parts.push_back(quadrant);
      }
    }
}

TEST(Subdivisions, KeepWhatNiuPrints) {
  // Table 5.3: 56 + 134 full ones, 334 partly full, 9 + 168 empty, 58.48 % of 896; and 95.98 % of 224.
  const SubdivisionCounts third{.uniform = 896, .full = {0, 0, 56, 134}, .empty = {0, 0, 9, 168}, .partly_full = 334};
  EXPECT_NEAR(third.kept(), 0.5848, 5e-5);
  const SubdivisionCounts second{.uniform = 224, .full = {0, 0, 56}, .empty = {0, 0, 9}, .partly_full = 159};
  EXPECT_NEAR(second.kept(), 0.9598, 5e-5);
}

TEST(Subdivisions, OfAQuarterAndACornerAreKnown) {
  // The first quadrant of 8 x 8 columns is bone, and the voxels at the last corner.
  const Scene scene =
      scene_of({8, 8, 2}, Vec3::Ones(), [](Coord at) { return (at.x < 4 && at.y < 4) || (at.x == 7 && at.y == 7); });
  const auto rows = count_subdivisions(scene.voxels(), scene.sections(), 3, always);
  ASSERT_TRUE(rows);
  ASSERT_EQ(rows->size(), 4u);
  EXPECT_EQ((*rows)[0].partly_full, 1);
  EXPECT_EQ((*rows)[1].full, (std::vector<std::int64_t>{0, 1}));
  EXPECT_EQ((*rows)[1].empty, (std::vector<std::int64_t>{0, 2}));
  EXPECT_EQ((*rows)[2].full, (std::vector<std::int64_t>{0, 1, 0}));
  EXPECT_EQ((*rows)[2].empty, (std::vector<std::int64_t>{0, 2, 3}));
  EXPECT_EQ((*rows)[3].full, (std::vector<std::int64_t>{0, 1, 0, 1}));
  EXPECT_EQ((*rows)[3].empty, (std::vector<std::int64_t>{0, 2, 3, 3}));
  EXPECT_EQ((*rows)[3].partly_full, 0);
  EXPECT_EQ((*rows)[3].uniform, 64);
  EXPECT_DOUBLE_EQ((*rows)[3].mean_voxels, 2.0);
}

TEST(Subdivisions, LeaveNothingOut) {
  // A quadrant that is full or empty stands for all that the uniform division would make of it. This holds where every
  // box can be halved as often as that.
  for (std::uint32_t seed = 0; seed < test::trials(80); ++seed) {
    std::mt19937 random(seed);
    const double share = static_cast<double>(random() % 100) / 99.0;
    Scene scene = scene_of({16, 16, 4}, Vec3::Ones(), [&](Coord at) {
      const bool corner = (at.x == 0 || at.x == 15) && (at.y == 0 || at.y == 15);
      return corner || (at.x / 4 + at.y / 4 + static_cast<int>(seed)) % 3 == 0 ||
             static_cast<double>(random() % 100) < 100.0 * share;
    });
    const std::vector<CoordBox> sections = scene.sections();
    const auto rows = count_subdivisions(scene.voxels(), sections, 4, always);
    ASSERT_TRUE(rows);
    for (std::size_t n = 0; n < rows->size(); ++n) {
      std::int64_t all = (*rows)[n].partly_full;
      for (std::size_t level = 0; level <= n; ++level)
        all += ((*rows)[n].full[level] + (*rows)[n].empty[level]) << (2 * (n - level));
      EXPECT_EQ(all, (*rows)[n].uniform) << seed << " " << n;
    }
    // At the end each box is a column of voxels, or larger and of one kind.
    EXPECT_EQ((*rows)[0].empty[0], 0);
  }
}

TEST(Subdivisions, CountBoneAsItsDefinitionDoes) {
  for (std::uint32_t seed = 0; seed < test::trials(100); ++seed) {
    const Scene scene = random_scene(seed);
    std::int64_t sum = 0;
    for (const CoordBox& section : scene.sections()) {
      std::int64_t bone = 0;
      for_each_voxel(section, [&](Coord at) { bone += scene.bone[scene.voxels().index(at)]; });
      EXPECT_EQ(bone_in(scene.voxels(), section), bone);
      EXPECT_EQ(fill_of(bone, section), bone == 0                    ? Fill::empty
                                        : bone == voxels_of(section) ? Fill::full
                                                                     : Fill::partly_full);
      sum += bone;
    }
    EXPECT_EQ(sum, scene.bones());
  }
}

TEST(Subdivisions, StopWhenAsked) {
  const Scene scene = random_scene(3);
  const auto rows = count_subdivisions(scene.voxels(), scene.sections(), 2, [](double) { return false; });
  ASSERT_FALSE(rows);
  EXPECT_EQ(rows.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon::subvolumes
