// The same bone in the tree of OpenVDB (Museth 2013), which Osteon uses: the measure for sub-volumes.
#pragma once
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/geometry/triangle_mesh.hpp"
#include "common/subvolumes/active_queue.hpp"
#include "common/volume/sparse_volume.hpp"

namespace osteon::subvolumes {

// What one pose of a tool did to the tree.
struct LeafStep {
  std::int64_t touched = 0;  // leaves that the World Bounding Block meets
  WalkCounts walk;           // of their voxels
  std::int64_t emptied = 0;  // leaves that were removed, because no bone is left in them
};

// Leaves of 8³ voxels with masked HU as floats, where they have bone; air elsewhere. Not synchronised. The
// voxels must outlive it.
class LeafTree {
 public:
  // `box`: that of the bone. Error: cancelled.
  [[nodiscard]] static Result<LeafTree> build(const BoneVoxels& voxels, const CoordBox& box,
                                              const KeepGoing& keep_going);

  [[nodiscard]] std::size_t leaves() const { return volume_.leaves().size(); }
  [[nodiscard]] std::int64_t bone() const;  // voxels of bone
  [[nodiscard]] std::size_t memory_bytes() const { return volume_.memory_bytes(); }
  // 1 for the voxels of bone in a box: columns fastest, then rows, then slices.
  [[nodiscard]] std::vector<std::uint8_t> bone_in(const CoordBox& box) const;
  // The surface, see reconstruct(). Error: cancelled.
  [[nodiscard]] Result<TriangleMesh> reconstruct(const KeepGoing& keep_going) const;
  // The walk-through of Niu 2008, §5.4, with leaves in the place of sub-volumes.
  LeafStep cut(const PlacedTool& tool);

 private:
  explicit LeafTree(const BoneVoxels& voxels);

  BoneVoxels voxels_;
  float least_, air_;
  SparseVolume volume_;
};

}  // namespace osteon::subvolumes
