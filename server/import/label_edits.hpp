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
  erase,     // those of a ball or polyline that are `bone`, or any bone if that is 0, become none
  cut,       // the voxels of `bone` on the side of a plane to which the normal points become `to_bone`, or none if 0
  // The segmentation takes these, not apply_edits().
  seed,     // a seed of `bone`, or of the next bone if that is 0
  outside,  // a seed of what is no bone
  box,      // only the voxels between two opposite corners count, along the axes of the scan
  label,    // what a person says of `bone`
  // The case takes these.
  landmark,  // a named point
};

struct LabelEdit {
  EditKind kind = EditKind::paint;
  int bone = 0, to_bone = 0;
  std::vector<Vec3> points_mm;  // centre, point of the plane, seed, landmark, or corners of the polyline or box; LPS
  double radius_mm = 0.0;
  // A unit vector. Of paint, scribble and erase, where zero is none: only voxels whose centre is less than half a voxel
  // from the plane through the first point count, so that a ball is a disc in one slice.
  Vec3 normal = Vec3::Zero();
  std::string name = {};  // of a label or landmark
  // Of a label.
  double opacity = 1.0;  // 0 to 1, in pictures of slices
  double minutes = 0.0;  // of a person's work
};

[[nodiscard]] std::string_view name_of(EditKind kind);
// The edit in one line of less than 200 bytes, for a label's provenance. Equal edits have equal lines. The points of a
// long polyline are named by a hash.
[[nodiscard]] std::string edit_text(const LabelEdit& edit);

// What an edit did.
struct EditEffect {
  std::array<std::int64_t, 256> gained{}, lost{};  // voxels of each label; 0: of no bone
};

// The voxels that paint, scribbles and erasers reach, within the grid; nothing if none does.
[[nodiscard]] std::optional<imaging::VoxelBox> reached_voxels(const imaging::HuVolume& grid,
                                                              std::span<const LabelEdit> edits);

// The voxels whose centres lie between the corners of the edits' box; nothing without one. Error: invalid_input (there
// is no such voxel).
[[nodiscard]] Result<std::optional<imaging::VoxelBox>> boxed_voxels(const imaging::HuVolume& grid,
                                                                    std::span<const LabelEdit> edits);

// Error: invalid_input (a landmark lies in no voxel of the scan; names it and the remedy).
[[nodiscard]] Result<void> check_landmarks(const imaging::HuVolume& grid, std::span<const LabelEdit> edits);

// Changes `labels`, which lie on the voxels of `grid`. A voxel belongs to a ball or a side if its centre does; the
// surface of the ball and the plane itself belong to them. Errors: invalid_input (a ball or polyline without a voxel of
// the scan, a bone that is not there when its edit comes), cancelled. They name the edit and the remedy, and leave
// `labels` as far as the edits before went.
[[nodiscard]] Result<std::vector<EditEffect>> apply_edits(const imaging::HuVolume& grid,
                                                          std::span<const LabelEdit> edits, imaging::VoxelMask& labels,
                                                          const KeepGoing& keep_going);

}  // namespace osteon::import
