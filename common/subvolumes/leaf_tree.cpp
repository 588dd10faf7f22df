#include "common/subvolumes/leaf_tree.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "common/subvolumes/voxel_surface.hpp"

namespace osteon::subvolumes {
namespace {

CoordBox leaf_box(Coord origin) { return {origin, origin + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1}}; }

// The samples of a leaf: slices fastest.
std::size_t within_leaf(Coord voxel, Coord origin) {
  const Coord at = voxel - origin;
  return to_index((at.x * kLeafSize + at.y) * kLeafSize + at.z);
}

template <class Call>
void for_voxels(const CoordBox& box, Call call) {
  for (int z = box.min.z; z <= box.max.z; ++z)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int x = box.min.x; x <= box.max.x; ++x) call(Coord{x, y, z});
}

// Calls with the origin of each leaf that a box meets.
template <class Call>
void for_leaves(const CoordBox& box, Call call) {
  if (box.empty()) return;
  const Coord first = floor_to(box.min, kLeafSize);
  for (int x = first.x; x <= box.max.x; x += kLeafSize)
    for (int y = first.y; y <= box.max.y; y += kLeafSize)
      for (int z = first.z; z <= box.max.z; z += kLeafSize) call(Coord{x, y, z});
}

}  // namespace

LeafTree::LeafTree(const BoneVoxels& voxels)
    : voxels_(voxels),
      least_(voxels.least_bone_hu()),
      air_(masked_hu(kAir_hu, false, voxels.least_bone_hu())),
      volume_(air_) {}

Result<LeafTree> LeafTree::build(const BoneVoxels& voxels, const CoordBox& box, const KeepGoing& keep_going) {
  LeafTree tree(voxels);
  const std::int16_t least = voxels.least_bone_hu();
  bool stopped = false;
  for_leaves(box, [&](Coord origin) {
    if (origin.y == floor_to(box.min, kLeafSize).y && !stopped)
      stopped = !keep_going(std::max(0.0, static_cast<double>(origin.x - box.min.x)) / box.dims().x);
    if (stopped) return;
    const CoordBox part = common_box(leaf_box(origin), voxels.box());
    bool any = false;
    for_voxels(part, [&](Coord voxel) { any = any || voxels.bone[voxels.index(voxel)] != 0; });
    if (!any) return;
    float* samples = tree.volume_.edit_leaf(origin);
    for_voxels(part, [&](Coord voxel) {
      const std::size_t i = voxels.index(voxel);
      samples[within_leaf(voxel, origin)] = masked_hu(voxels.hu[i], voxels.bone[i] != 0, least);
    });
  });
  if (stopped) return stopped_while("making the tree");
  return tree;
}

std::int64_t LeafTree::bone() const {
  std::int64_t count = 0;
  for (const Coord origin : volume_.leaves()) {
    const float* samples = volume_.leaf(origin);
    count += std::count_if(samples, samples + kLeafVoxels, [&](float hu) { return hu >= least_; });
  }
  return count;
}

std::vector<std::uint8_t> LeafTree::bone_in(const CoordBox& box) const {
  std::vector<std::uint8_t> bone(static_cast<std::size_t>(voxels_of(box)), 0);
  const Coord dims = box.dims();
  for_leaves(box, [&](Coord origin) {
    const float* samples = volume_.leaf(origin);
    if (samples == nullptr) return;
    for_voxels(common_box(leaf_box(origin), box), [&](Coord voxel) {
      const Coord at = voxel - box.min;
      bone[(to_index(at.z) * to_index(dims.y) + to_index(at.y)) * to_index(dims.x) + to_index(at.x)] =
          samples[within_leaf(voxel, origin)] >= least_ ? 1 : 0;
    });
  });
  return bone;
}

Result<TriangleMesh> LeafTree::reconstruct(const KeepGoing& keep_going) const {
  // A cell belongs to the leaf of its first voxel, which may have no bone and no leaf.
  std::set<Coord> origins;
  for (const Coord leaf : volume_.leaves())
    for (int corner = 0; corner < 8; ++corner)
      origins.insert(leaf - kLeafSize * Coord{corner >> 2 & 1, corner >> 1 & 1, corner & 1});
  constexpr std::ptrdiff_t kSide = kLeafSize + 1;
  std::vector<float> values(kSide * kSide * kSide);
  TriangleMesh mesh;
  std::size_t done = 0;
  for (const Coord origin : origins) {
    if (done++ % 64 == 0 && !keep_going(static_cast<double>(done) / static_cast<double>(origins.size())))
      return stopped_while("reconstructing the surface");
    const CoordBox box{origin, origin + Coord{kLeafSize, kLeafSize, kLeafSize}};
    volume_.gather(box, values);
    add_triangles(MaskedBox<float>{box, values, {kSide * kSide, kSide, 1}}, voxels_, mesh);
  }
  return mesh;
}

LeafStep LeafTree::cut(const PlacedTool& tool) {
  const VoxelWalk walk(tool, voxels_.geometry);
  LeafStep step;
  for_leaves(common_box(walk.block(), voxels_.box()), [&](Coord origin) {
    if (std::as_const(volume_).leaf(origin) == nullptr) return;
    ++step.touched;
    float* samples = volume_.edit_leaf(origin);
    const WalkCounts counts = walk.through(
        leaf_box(origin), [&](Coord voxel) { return samples[within_leaf(voxel, origin)] >= least_; },
        [&](Coord voxel) { samples[within_leaf(voxel, origin)] = air_; });
    step.walk += counts;
    if (counts.removed == 0 || std::any_of(samples, samples + kLeafVoxels, [&](float hu) { return hu >= least_; }))
      return;
    volume_.set_constant(origin, air_);
    ++step.emptied;
  });
  return step;
}

}  // namespace osteon::subvolumes
