// Manual corrections of labelled bones: a list of edits that is replayed in its order.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::import {

enum class EditKind {
  paint,     // the voxels of a ball become `bone`
  scribble,  // those within the radius of a polyline become `bone`
  erase,     // the voxels of a ball that are `bone`, or any bone if that is 0, become none
  cut,       // the voxels of `bone` on the side of a plane to which the normal points become `to_bone`, or none if 0
  seed,      // a seed of `bone`, or of the next bone if that is 0; the segmentation takes it, not apply_edits()
};

struct LabelEdit {
  EditKind kind = EditKind::paint;
  int bone = 0, to_bone = 0;
  std::vector<Vec3> points_mm;  // centre, point of the plane, seed, or corners of the polyline; LPS
  double radius_mm = 0.0;
  Vec3 normal = Vec3::Zero();  // a unit vector
};

[[nodiscard]] std::string_view name_of(EditKind kind);
// The edit in one line of less than 200 bytes, for a label's provenance. Equal edits have equal lines. The points of a
// long polyline are named by a hash.
[[nodiscard]] std::string edit_text(const LabelEdit& edit);

// What an edit did.
struct EditEffect {
  std::array<std::int64_t, 256> gained{}, lost{};  // voxels of each label; 0: of no bone
};

// The voxels that edits may turn into bone, within the grid; nothing if no edit can.
[[nodiscard]] std::optional<imaging::VoxelBox> painted_voxels(const imaging::HuVolume& grid,
                                                              std::span<const LabelEdit> edits);

// Changes `labels`, which lie on the voxels of `grid`. A voxel belongs to a ball or a side if its centre does; the
// surface of the ball and the plane itself belong to them. Errors: invalid_input (a ball or polyline without a voxel of
// the scan, a bone that is not there when its edit comes), cancelled. They name the edit and the remedy, and leave
// `labels` as far as the edits before went.
[[nodiscard]] Result<std::vector<EditEffect>> apply_edits(const imaging::HuVolume& grid,
                                                          std::span<const LabelEdit> edits, imaging::VoxelMask& labels,
                                                          const KeepGoing& keep_going);

}  // namespace osteon::import
