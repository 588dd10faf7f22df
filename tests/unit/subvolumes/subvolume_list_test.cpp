// The list of sub-volumes: each voxel of bone is in one of them, with the scan's values.
#include "common/subvolumes/subvolume_list.hpp"

#include <gtest/gtest.h>

#include "tests/support/trials.hpp"
#include "tests/unit/subvolumes/list_checks.hpp"

namespace osteon::subvolumes {
namespace {

TEST(SubVolumeList, HasEachVoxelOfBoneOnce) {
  for (std::uint32_t seed = 0; seed < test::trials(160); ++seed) {
    const Scene scene = random_scene(seed);
    for (int subdivisions = 0; subdivisions <= 5; ++subdivisions) {
      const auto list = SubVolumeList::divide(scene.voxels(), scene.sections(), subdivisions, always);
      ASSERT_TRUE(list);
      expect_partition(*list, scene, subdivisions);
      for (const SubVolume& part : list->all())
        for_each_voxel(part.box,
                       [&](Coord at) { EXPECT_EQ(part.hu[part.index(at)], scene.hu[scene.voxels().index(at)]); });
      EXPECT_EQ(list->bone(), scene.bones());
    }
  }
}

TEST(SubVolumeList, IsThatOfTheTable) {
  for (std::uint32_t seed = 0; seed < test::trials(100); ++seed) {
    const Scene scene = random_scene(seed);
    const auto rows = count_subdivisions(scene.voxels(), scene.sections(), 3, always);
    const auto list = SubVolumeList::divide(scene.voxels(), scene.sections(), 3, always);
    ASSERT_TRUE(rows && list);
    const auto full = std::ranges::count(list->all(), Fill::full, &SubVolume::fill);
    EXPECT_EQ(full, rows->back().all_full()) << seed;
    EXPECT_EQ(static_cast<std::int64_t>(list->all().size()) - full, rows->back().partly_full) << seed;
  }
}

TEST(SubVolumeList, NeedsLessMemoryWithEachDivisionOfASparseBone) {
  const Scene scene = scene_of({256, 256, 4}, Vec3::Ones(),
                               [](Coord at) { return (at.x < 16 && at.y < 16) || (at.x > 240 && at.y > 240); });
  std::size_t last = std::numeric_limits<std::size_t>::max();
  for (int subdivisions = 0; subdivisions <= 4; ++subdivisions) {
    const auto list = SubVolumeList::divide(scene.voxels(), scene.sections(), subdivisions, always);
    ASSERT_TRUE(list);
    EXPECT_GE(list->memory_bytes(), static_cast<std::size_t>(list->voxels()) * 3);
    EXPECT_LT(list->memory_bytes(), last);
    last = list->memory_bytes();
  }
}

TEST(SubVolumeList, StopsWhenAsked) {
  const Scene scene = random_scene(5);
  const auto list = SubVolumeList::divide(scene.voxels(), scene.sections(), 2, [](double) { return false; });
  ASSERT_FALSE(list);
  EXPECT_EQ(list.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon::subvolumes
