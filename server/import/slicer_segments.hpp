// The segments that 3D Slicer names in the header of a .seg.nrrd file.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "common/core/result.hpp"

namespace osteon::import {

struct SlicerSegment {
  std::string name;
  std::string type;  // from the terminology, such as "Femur"; empty if there is none
  int layer = 0;     // its voxels are those of this layer
  int value = 1;     // with this value
};

// The key of a field and its value, as they are in the file.
using HeaderFields = std::vector<std::pair<std::string, std::string>>;

// Segments of the fields Segment0_Name, Segment0_LabelValue, Segment0_Layer, Segment0_Tags and so on, by their numbers.
// Other fields do not matter. Without a layer and a value, as Slicer wrote until 2020, segment N is layer N, and its
// voxels are 1. Error: invalid_input (a layer or value that is no such number, more than 65535 segments, two segments
// of one layer and value), without the file's name.
[[nodiscard]] Result<std::vector<SlicerSegment>> slicer_segments(const HeaderFields& fields);

}  // namespace osteon::import
