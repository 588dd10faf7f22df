#include "common/subvolumes/active_queue.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

namespace osteon::subvolumes {

WalkCounts& WalkCounts::operator+=(const WalkCounts& other) {
  visited += other.visited;
  computed += other.computed;
  modified += other.modified;
  removed += other.removed;
  return *this;
}

CoordBox world_block(const PlacedTool& tool, const ScanGeometry& geometry) {
  const Eigen::Matrix3d to_voxel = geometry.axes_mm.inverse();
  const Box& local = tool.solid.bounds;
  Box block;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 at((corner & 1) != 0 ? local.max_mm.x() : local.min_mm.x(),
                  (corner & 2) != 0 ? local.max_mm.y() : local.min_mm.y(),
                  (corner & 4) != 0 ? local.max_mm.z() : local.min_mm.z());
    block.include(to_voxel * (tool.pose_bone_tool.point(at) - geometry.origin_mm));
  }
  // A tool far from the scan must not overflow the integers of a voxel.
  static constexpr double kFarthest = 1 << 24;
  const auto whole = [](double value) { return static_cast<std::int32_t>(std::clamp(value, -kFarthest, kFarthest)); };
  // A voxel on a face belongs to the block, also after rounding.
  constexpr double kMargin = 1e-6;
  const Vec3 low = (block.min_mm.array() - kMargin).ceil(), high = (block.max_mm.array() + kMargin).floor();
  return {{whole(low.x()), whole(low.y()), whole(low.z())}, {whole(high.x()), whole(high.y()), whole(high.z())}};
}

VoxelWalk::VoxelWalk(const PlacedTool& tool, const ScanGeometry& geometry)
    : solid_(tool.solid), block_(world_block(tool, geometry)) {
  const Pose pose_tool_bone = tool.pose_bone_tool.inverse();
  origin_tool_mm_ = pose_tool_bone.point(geometry.origin_mm);
  axes_tool_mm_ = pose_tool_bone.rotation.toRotationMatrix() * geometry.axes_mm;
}

VoxelKind VoxelWalk::kind_of(Coord voxel) const {
  const Vec3 at_mm = origin_tool_mm_ + axes_tool_mm_ * Vec3(voxel.x, voxel.y, voxel.z);
  const Box& local = solid_.bounds;
  if ((at_mm.array() < local.min_mm.array()).any() || (at_mm.array() > local.max_mm.array()).any())
    return VoxelKind::visited;
  return solid_(at_mm) > 0.0 ? VoxelKind::computed : VoxelKind::modified;
}

ActiveStep cut(SubVolumeList& list, const PlacedTool& tool, const ScanGeometry& geometry) {
  const VoxelWalk walk(tool, geometry);
  std::deque<SubVolumeList::Place> queue;
  for (const SubVolumeList::Place place : list.places())
    if (!common_box(place->box, walk.block()).empty()) queue.push_back(place);
  ActiveStep step;
  step.queued = static_cast<std::int64_t>(queue.size());
  for (; !queue.empty(); queue.pop_front()) {
    const SubVolumeList::Place place = queue.front();
    SubVolume& active = *place;
    const WalkCounts counts = walk.through(
        active.box, [&](Coord voxel) { return active.is_bone[active.index(voxel)] != 0; },
        [&](Coord voxel) {
          active.is_bone[active.index(voxel)] = 0;
          active.hu[active.index(voxel)] = kAir_hu;
        });
    step.walk += counts;
    if (counts.removed == 0) continue;
    const SubVolumeList::Update update = list.update(place);
    step.made += update.made;
    step.emptied += update.removed;
  }
  return step;
}

}  // namespace osteon::subvolumes
