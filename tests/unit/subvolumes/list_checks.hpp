// What holds for every list of sub-volumes, before and after cuts.
#pragma once
#include <gtest/gtest.h>

#include "common/subvolumes/subvolume_list.hpp"
#include "tests/unit/subvolumes/scenes.hpp"

namespace osteon::subvolumes {

// The bone of the list is that of the scene. Each voxel is in one sub-volume at most, and none is empty.
inline void expect_partition(const SubVolumeList& list, const Scene& scene, int subdivisions) {
  std::vector<int> having(scene.bone.size(), 0);
  for (const SubVolume& part : list.all()) {
    EXPECT_GT(part.bone, 0);
    EXPECT_EQ(part.fill, part.bone == voxels_of(part.box) ? Fill::full : Fill::partly_full);
    EXPECT_LE(part.level, subdivisions);
    // One that is partly full is as fine as it can be.
    EXPECT_TRUE(part.fill == Fill::full || part.level == subdivisions ||
                (part.box.dims().x == 1 && part.box.dims().y == 1));
    std::int64_t bone = 0;
    for_each_voxel(part.box, [&](Coord at) {
      const std::size_t i = scene.voxels().index(at);
      ++having[i];
      bone += part.is_bone[part.index(at)] != 0;
      EXPECT_EQ(part.is_bone[part.index(at)] != 0, scene.bone[i] != 0);
    });
    EXPECT_EQ(bone, part.bone);
  }
  for (std::size_t i = 0; i < having.size(); ++i)
    EXPECT_TRUE(having[i] == 1 || (having[i] == 0 && scene.bone[i] == 0)) << having[i];
}

}  // namespace osteon::subvolumes
