// Finishes the kept bones: separates those that touch, finds their surface, and replays a person's edits.
#pragma once
#include <span>

#include "common/imaging/surface_level.hpp"
#include "server/import/ct_import.hpp"

namespace osteon::import {

// `bones`: the bone number of each voxel of `volume`, from 1; 0: none. Gets the numbers of the separated and edited
// bones. Their surface moves to its level, before the edits. `seeds`: voxels of `volume`. Lists the bones in `found`
// with --separate and edits. Errors: invalid_input (seeds or edits that cannot be, no bone left), exhausted (too many
// bones, memory), cancelled, internal.
[[nodiscard]] Result<imaging::SurfaceLevel> finish_bones(const imaging::HuVolume& volume, const CtOptions& options,
                                                         std::span<const imaging::BoneSeed> seeds,
                                                         imaging::VoxelMask& bones, CtSegmentation& found,
                                                         const KeepGoing& keep_going);

// Replays the edits on the labels of a label map, and lists them there. A bone that only edits made is "bone N".
// Returns what each did, for a person. Errors: as above.
[[nodiscard]] Result<std::vector<std::string>> edit_labels(const imaging::HuVolume& grid, const CtOptions& options,
                                                           PlacedLabels& placed, const KeepGoing& keep_going);

// The box of the voxels that are not 0.
[[nodiscard]] imaging::VoxelBox voxels_of(const imaging::VoxelMask& bones);

}  // namespace osteon::import
