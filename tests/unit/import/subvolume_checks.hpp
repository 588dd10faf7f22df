// What holds for the tables of `osteon-import report`, whatever the bone.
#pragma once
#include <gtest/gtest.h>

#include "server/import/subvolume_measures.hpp"

namespace osteon::import {

// All ways have one surface, and cutting takes the same voxels of each.
inline void expect_consistent(const SubVolumeMeasures& m) {
  EXPECT_GT(m.bone, 0);
  EXPECT_EQ(m.object_box.triangles, m.original.triangles);
  EXPECT_EQ(m.section_sum.triangles, m.original.triangles);
  EXPECT_EQ(m.tree.triangles, m.original.triangles);
  EXPECT_LE(m.object_box.voxels, m.original.voxels);
  EXPECT_LE(m.section_sum.voxels, m.object_box.voxels);
  EXPECT_LE(m.section_sum.file_bytes, m.original.file_bytes + 1000 * static_cast<std::int64_t>(m.sections.size()));
  EXPECT_GE(m.section_sum.voxels, m.bone);
  EXPECT_LE(m.listed_voxels, m.section_sum.voxels);
  EXPECT_EQ(m.listed, m.subdivisions.back().all_full() + m.subdivisions.back().partly_full);
  std::int64_t bone = m.bone;
  for (const ActiveReport& step : m.steps) {
    EXPECT_EQ(step.walk.removed, step.leaf_walk.removed);
    bone -= step.walk.removed;
    EXPECT_EQ(step.bone, bone);
    EXPECT_EQ(step.leaf_bone, bone);
    EXPECT_EQ(step.queued.size(), static_cast<std::size_t>(step.poses));
    EXPECT_EQ(step.touched.size(), static_cast<std::size_t>(step.poses));
  }
}

}  // namespace osteon::import
