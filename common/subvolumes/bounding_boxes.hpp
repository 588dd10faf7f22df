// Bounding volumes of a bone (Niu 2008, §5.2.1): one box around all of it, and one for each section along the slices.
#pragma once
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/subvolumes/bone_voxels.hpp"

namespace osteon::subvolumes {

// The box around the bone of each slice; empty for a slice without bone. Error: cancelled.
[[nodiscard]] Result<std::vector<CoordBox>> slice_boxes(const BoneVoxels& voxels, const KeepGoing& keep_going);

// The object bounding box: the box around the bone of all slices. Empty if there is none.
[[nodiscard]] CoordBox object_box(std::span<const CoordBox> slices);

// Voxels of the boxes, and for each box one more slice of it. This is what section_boxes() makes as small as possible.
// The cells between two sections need a slice of both, so a section has a price.
[[nodiscard]] std::int64_t section_cost(std::span<const CoordBox> sections);

// The section bounding boxes, in the order of the slices. Number and heights follow from the bone: of all divisions
// into sections of neighbouring slices, this one has the smallest section_cost(). Slices without bone belong to no
// section. Niu 2008, §5.2.1, asks for the smallest whole and names no algorithm. This one is dynamic programming from
// the last slice to the first; its time grows with the square of the number of slices.
[[nodiscard]] std::vector<CoordBox> section_boxes(std::span<const CoordBox> slices);

}  // namespace osteon::subvolumes
