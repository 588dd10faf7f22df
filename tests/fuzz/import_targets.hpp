// Fuzz targets for the readers of the import that untrusted files can reach.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

[[nodiscard]] Target mesh_target();             // STL
[[nodiscard]] Target tool_file_target();        // YAML file of a tool
[[nodiscard]] Target carve_script_target();     // YAML list of cuts
[[nodiscard]] Target legend_target();           // YAML file with the colours of a label volume
[[nodiscard]] Target edits_target();            // YAML list of corrections of labels
[[nodiscard]] Target landmarks_target();        // YAML list of points in two scans
[[nodiscard]] Target sub_volume_target();       // SBBn.dat
[[nodiscard]] Target sub_volume_meta_target();  // the Meta file that lists them
[[nodiscard]] Target case_info_target();        // case.json beside a valid bone.vdb
[[nodiscard]] Target bone_volume_target();      // bone.vdb beside a valid case.json
[[nodiscard]] Target scan_volume_target();      // scan.vdb beside a valid case.json
[[nodiscard]] Target cut_fields_target();       // cut fields
[[nodiscard]] Target dicom_target();            // one CT slice
[[nodiscard]] Target inv3_target();             // InVesalius project
[[nodiscard]] Target scan_archive_target();     // zip, ISO 9660 image, tar
[[nodiscard]] Target label_slice_target();      // PNG
[[nodiscard]] Target raw_volume_target();       // numbers, and the options that describe them
[[nodiscard]] Target grey_slice_target();       // PNG
[[nodiscard]] Target label_names_target();      // names of labels on the command line
[[nodiscard]] Target label_header_target();     // names of labels in NIfTI and NRRD
[[nodiscard]] Target dicom_segments_target();   // DICOM SEG

}  // namespace osteon::fuzz
