// The part of a CT or label volume that a case keeps as its scan, and what the case says of its labels.
#pragma once
#include <array>

#include "common/imaging/hu_volume.hpp"
#include "common/imaging/label_volume.hpp"
#include "common/imaging/voxel_mask.hpp"
#include "common/volume/case_scan.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/label_stack.hpp"
#include "server/import/placed_labels.hpp"

namespace osteon::import {

// What was found of each voxel of a volume.
struct FoundVoxels {
  const imaging::VoxelMask& labels;  // what it belongs to; 0: nothing
  const imaging::VoxelMask& bones;   // 0: not bone
  const imaging::VoxelMask& tissue;  // a value of Tissue, for bone; 0: by its density. May be empty
};

// Voxels from `first` to `last`, and those within `margin_mm` of this box along each axis. HU are those of `volume`.
// The tissue of bone that is not known is cortical from kCorticalFrom_g_cm3 on, otherwise trabecular. Voxels without a
// bone have none.
[[nodiscard]] CaseScan kept_scan(const imaging::HuVolume& volume, const FoundVoxels& found,
                                 const std::array<int, 3>& first, const std::array<int, 3>& last,
                                 const CtOptions& options);
// Lists the labels and tissues that kept_scan() gives.
void list_labels(const CaseScan& scan, const CtOptions& options, const CtSegmentation& found, CaseInfo& info);

// The labels of a label volume without HU, as far as its box reaches.
[[nodiscard]] CaseScan kept_scan(const imaging::LabelVolume& volume);
void list_labels(const LabelLegend& legend, CaseInfo& info);

// Lists the labels of a label map, and the tissues that kept_scan() gives.
void list_labels(const CaseScan& scan, const PlacedLabels& placed, CaseInfo& info);

}  // namespace osteon::import
