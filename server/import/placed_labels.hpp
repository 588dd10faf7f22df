// The labels of a label map on the voxels of a CT.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/imaging/voxel_mask.hpp"
#include "server/import/label_map.hpp"
#include "server/import/structure_names.hpp"

namespace osteon::import {

struct LeftOutLabel {
  std::string name;
  double volume_cm3 = 0.0;
};

struct PlacedLabels {
  imaging::VoxelMask values;      // of the CT's voxels: a value of `labels`, or 0
  std::vector<CaseLabel> labels;  // those that the CT has voxels of, with their provenance
  std::vector<double> cm3;        // of each label, in the CT
  std::vector<LeftOutLabel> left_out;
  bool same_grid = false;   // a voxel of the labels for each voxel of the CT that both cover
  bool oriented = true;     // the file says how it lies in the patient
  double beyond_cm3 = 0.0;  // of labels, where the CT has ended; a difference of volumes
};

// Each voxel of the CT takes the label of the nearest voxel of the map. If both have the same grid, also with other
// directions of the axes or another first voxel, that is voxel for voxel. A label keeps its number if it is from 1 to
// 255 and free. `frame_of_reference`: the CT's UID, empty if it has none.
// Errors: invalid_input (a label without a known name, two labels in one voxel, no voxel in the CT, another frame of
// reference, no bone, more than 255 labels), exhausted, cancelled. They name the file and the remedy.
[[nodiscard]] Result<PlacedLabels> place_labels(LabelMap map, const LabelNames& names, const imaging::HuVolume& ct,
                                                const std::string& frame_of_reference, const KeepGoing& keep_going);

// The labels, what they are for, and what was left out, as lines for a person. `bone_cm3`: of the case.
[[nodiscard]] std::string labels_text(const PlacedLabels& placed, double bone_cm3);

}  // namespace osteon::import
