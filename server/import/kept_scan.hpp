// The part of a CT or label volume that a case keeps as its scan, and what the case says of its labels.
#pragma once
#include <array>
#include <bitset>

#include "common/imaging/hu_volume.hpp"
#include "common/imaging/label_volume.hpp"
#include "common/imaging/voxel_mask.hpp"
#include "common/volume/case_scan.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/label_stack.hpp"
#include "server/import/placed_labels.hpp"

namespace osteon::import {

// Voxels from `first` to `last`, and those within `margin_mm` of this box along each axis.
[[nodiscard]] imaging::VoxelBox kept_voxels(const imaging::HuVolume& volume, const std::array<int, 3>& first,
                                            const std::array<int, 3>& last, double margin_mm);

// What is known of each voxel of a volume.
struct KnownVoxels {
  imaging::SparseMask labels;    // what it belongs to; 0: nothing
  imaging::VoxelMask tissue;     // a value of Tissue, for bone; 0: by its density. Empty: all by their density
  std::bitset<256> bone_labels;  // which labels are bone; not 0
};

// The voxels of `box`, with the HU of `volume`. The tissue of bone that is not known is cortical from
// kCorticalFrom_g_cm3 on, otherwise trabecular. Voxels without a bone have none. Takes over the memory of both. Error:
// cancelled.
[[nodiscard]] Result<CaseScan> kept_scan(imaging::HuVolume volume, KnownVoxels known, const imaging::VoxelBox& box,
                                         const DensityCalibration& calibration, const KeepGoing& keep_going);
// Lists the labels and tissues that kept_scan() gives.
void list_labels(const CaseScan& scan, const CtOptions& options, const CtSegmentation& found, CaseInfo& info);

// What a person says of a label: its name, and how long the work took. Nothing without such an edit.
void name_label(std::span<const LabelEdit> edits, CaseLabel& label);

// The labels of a label volume without HU, as far as its box reaches. Error: cancelled.
[[nodiscard]] Result<CaseScan> kept_scan(const imaging::LabelVolume& volume, const KeepGoing& keep_going);
void list_labels(const LabelLegend& legend, CaseInfo& info);

// Lists the labels of a label map, and the tissues that kept_scan() gives.
void list_labels(const CaseScan& scan, const PlacedLabels& placed, const CtOptions& options, CaseInfo& info);

}  // namespace osteon::import
