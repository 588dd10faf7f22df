// The part of a CT or label volume that a case keeps as its scan, and what the case says of its labels.
#pragma once
#include <array>

#include "common/imaging/hu_volume.hpp"
#include "common/imaging/label_volume.hpp"
#include "common/imaging/voxel_mask.hpp"
#include "common/volume/case_scan.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/label_stack.hpp"

namespace osteon::import {

// Voxels from `first` to `last`, and those within `margin_mm` of this box along each axis.
[[nodiscard]] imaging::VoxelBox kept_voxels(const imaging::HuVolume& volume, const std::array<int, 3>& first,
                                            const std::array<int, 3>& last, double margin_mm);
// HU are those of `volume`. Labels are the numbers in `bones`; tissues are values of Tissue: metal and enamel as in
// `hard` (which may be empty), cortical from kCorticalFrom_g_cm3 on, otherwise trabecular. Voxels without a bone have
// neither. Takes over the memory of all three.
[[nodiscard]] CaseScan kept_scan(imaging::HuVolume volume, imaging::VoxelMask bones, imaging::VoxelMask hard,
                                 const imaging::VoxelBox& box, const CtOptions& options);
// Lists the labels and tissues that kept_scan() gives.
void list_labels(const CaseScan& scan, const CtOptions& options, const CtSegmentation& found, CaseInfo& info);

// The labels of a label volume without HU, as far as its box reaches.
[[nodiscard]] CaseScan kept_scan(const imaging::LabelVolume& volume);
void list_labels(const LabelLegend& legend, CaseInfo& info);

}  // namespace osteon::import
