// The active sub-volumes of a tool (Niu 2008, §5.4): those that the tool's box meets are queued, and their voxels are
// walked through and removed.
#pragma once
#include <cstdint>

#include "common/geometry/pose.hpp"
#include "common/subvolumes/subvolume_list.hpp"
#include "common/tools/tool_solid.hpp"

namespace osteon::subvolumes {

// A cutting tool at one moment. Frames: the solid and its box in that of the tool (Local Bounding Block).
struct PlacedTool {
  Implicit solid;  // see cut_solid()
  Pose pose_bone_tool;
};

// The kinds of voxels of Niu 2008, §5.4. Voxels beyond the World Bounding Block are not looked at.
struct WalkCounts {
  std::int64_t visited = 0;   // within the World Bounding Block, beyond the Local Bounding Block
  std::int64_t computed = 0;  // within that, beyond the tool
  std::int64_t modified = 0;  // within the tool
  std::int64_t removed = 0;   // of those, voxels that were bone

  WalkCounts& operator+=(const WalkCounts& other);
  friend bool operator==(const WalkCounts&, const WalkCounts&) = default;
};

// The World Bounding Block: voxels whose centres may lie within the tool. Its axes are those of the scan. Empty if the
// tool lies between voxels.
[[nodiscard]] CoordBox world_block(const PlacedTool& tool, const ScanGeometry& geometry);

// What a voxel is to a tool.
enum class VoxelKind : std::uint8_t { visited, computed, modified };

// Classes of the voxels of one tool.
class VoxelWalk {
 public:
  VoxelWalk(const PlacedTool& tool, const ScanGeometry& geometry);
  [[nodiscard]] const CoordBox& block() const { return block_; }
  [[nodiscard]] VoxelKind kind_of(Coord voxel) const;

  // Calls is_bone(voxel) for each voxel of the tool in the box, and remove(voxel) if that is true.
  template <class IsBone, class Remove>
  [[nodiscard]] WalkCounts through(const CoordBox& box, IsBone is_bone, Remove remove) const {
    WalkCounts counts;
    const CoordBox part = common_box(box, block_);
    for (int z = part.min.z; z <= part.max.z; ++z)
      for (int y = part.min.y; y <= part.max.y; ++y)
        for (int x = part.min.x; x <= part.max.x; ++x) {
          const Coord voxel{x, y, z};
          const VoxelKind kind = kind_of(voxel);
          counts.visited += kind == VoxelKind::visited;
          counts.computed += kind == VoxelKind::computed;
          if (kind != VoxelKind::modified) continue;
          ++counts.modified;
          if (!is_bone(voxel)) continue;
          ++counts.removed;
          remove(voxel);
        }
    return counts;
  }

 private:
  const Implicit& solid_;  // of the tool, which must outlive the walk
  CoordBox block_;
  Vec3 origin_tool_mm_;           // of the first voxel, tool frame
  Eigen::Matrix3d axes_tool_mm_;  // steps to the next column, row and slice, tool frame
};

// What one pose of a tool did.
struct ActiveStep {
  std::int64_t queued = 0;   // active sub-volumes
  WalkCounts walk;           // of their voxels
  std::int64_t made = 0;     // sub-volumes, by dividing full ones
  std::int64_t emptied = 0;  // sub-volumes that were removed, because no bone is left in them
};

// Puts the sub-volumes that meet the World Bounding Block into a queue, takes them out one by one, removes the bone
// within the tool, and updates the list. A removed voxel becomes air.
[[nodiscard]] ActiveStep cut(SubVolumeList& list, const PlacedTool& tool, const ScanGeometry& geometry);

}  // namespace osteon::subvolumes
