// What a stranger's files can reach in the import.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

[[nodiscard]] Target mesh_target();          // STL
[[nodiscard]] Target tool_file_target();     // YAML of a tool
[[nodiscard]] Target carve_script_target();  // YAML of cuts
[[nodiscard]] Target legend_target();        // YAML of a label volume's colours
[[nodiscard]] Target case_info_target();     // case.json beside a sound bone.vdb
[[nodiscard]] Target bone_volume_target();   // bone.vdb beside a sound case.json
[[nodiscard]] Target cut_fields_target();    // carved fields
[[nodiscard]] Target dicom_target();         // one CT slice
[[nodiscard]] Target inv3_target();          // InVesalius project
[[nodiscard]] Target scan_archive_target();  // zip, ISO 9660 image, tar
[[nodiscard]] Target label_slice_target();   // PNG

}  // namespace osteon::fuzz
