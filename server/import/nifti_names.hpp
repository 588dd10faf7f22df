// Names of labels in the header of a NIfTI file, as TotalSegmentator writes them.
#pragma once
#include <map>
#include <string>
#include <string_view>

namespace osteon::import {

// `head`: the file's first bytes, unpacked, up to the voxels. A header extension with the LabelTable of Caret names
// labels by their numbers. Empty if there is none, or none that can be read: names are never needed to read the voxels.
[[nodiscard]] std::map<int, std::string> nifti_label_names(std::string_view head);

}  // namespace osteon::import
