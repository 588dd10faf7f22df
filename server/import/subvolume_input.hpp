// The scan and its bone that `osteon-import report` divides: of a case, of a scan that has not been
// imported, or of files of sub-volumes.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/subvolumes/bone_voxels.hpp"
#include "server/import/ct_scan.hpp"
#include "server/import/label_map.hpp"

namespace osteon::import {

struct SubVolumeInput {
  ScanGeometry geometry;
  std::vector<std::int16_t> hu;
  std::vector<std::uint8_t> bone;  // 1: bone
  double threshold_hu = 0.0;
  std::string what;  // for the report: kind and size, no name

  [[nodiscard]] subvolumes::BoneVoxels voxels() const { return {geometry, hu, bone, threshold_hu}; }
};

// Whether the folder is a case.
[[nodiscard]] bool is_case(const std::filesystem::path& folder);

// The scan that a case keeps; its labels say what is bone. Errors: those of Case::load() and load_scan(), and
// invalid_input (the case has no HU).
[[nodiscard]] Result<SubVolumeInput> input_of_case(const std::filesystem::path& folder, const KeepGoing& keep_going);

// The whole scan from which a case was imported, with the bone of the case. `name`: of the scan, for errors. Error:
// invalid_input (the voxels of the case are not some of the scan's).
[[nodiscard]] Result<SubVolumeInput> input_in_source(const SubVolumeInput& of_case, CtScan source,
                                                     const std::string& name);

// Whether the file is the Meta file of sub-volumes, by its name.
[[nodiscard]] bool is_meta_file(const std::filesystem::path& file);

// The sub-volumes that a Meta file lists, each at its place in one box; air between them. Bone is what reaches the
// threshold. Errors: those of read_sub_volumes(), and invalid_input (the files do not lie on the same voxels, they are
// too far apart, or there is no bone).
[[nodiscard]] Result<SubVolumeInput> input_of_files(const std::filesystem::path& meta_file, double threshold_hu,
                                                    const KeepGoing& keep_going);

// The whole scan. Bone is the largest island that is bone, with its marrow, by the steps of osteon-import ct. It leaves
// out those that part bone from tables, casts and contrast medium that touch it. Errors: invalid_input (no bone),
// cancelled.
[[nodiscard]] Result<SubVolumeInput> input_of_scan(CtScan scan, double threshold_hu, const KeepGoing& keep_going);

// The whole scan. Bone is what has any number in a label map on the same voxels, such as one of the window. Errors:
// invalid_input (other voxels; no bone), cancelled.
[[nodiscard]] Result<SubVolumeInput> input_of_marked(CtScan scan, const LabelMap& marks, double threshold_hu,
                                                     const KeepGoing& keep_going);

}  // namespace osteon::import
