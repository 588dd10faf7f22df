// A label map as a file gives it: structures on voxels of their own, and the readers of all its kinds.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/components.hpp"
#include "common/imaging/hu_volume.hpp"

namespace osteon::import {

struct LabelSegment {
  int number = 0;                       // in the file: the value of its voxels, or the number of the segment
  std::string name;                     // in the file; empty if it has none
  std::string type;                     // its coded type in words, such as "Femur"; empty if it has none
  std::vector<imaging::VoxelRun> runs;  // its voxels; segments may share some

  [[nodiscard]] std::int64_t voxels() const;
};

struct LabelMap {
  std::string file;                    // as the user gave it, for errors
  std::string kind;                    // such as "NIfTI", for a label's provenance
  imaging::HuVolume grid;              // where its voxels lie; without values
  bool oriented = true;                // the file says how it lies in the patient
  bool numbered = true;                // numbers of segments are those of the file, not of the order of files
  std::string frame_of_reference;      // UID of DICOM, empty for others; never stored
  std::vector<LabelSegment> segments;  // by layer, then by number
};

// `input`: a NIfTI, NRRD (also one of 3D Slicer's segmentations) or MetaImage file of labels; a DICOM SEG file of
// binary segments; or a folder with one such file for each structure, named as the structure. The labels.nii.gz of a
// phantom has the names of the truth.json beside it. Libraries read voxels in another process. Values are whole numbers
// from 0 to 65535, and 0 is no structure. Errors: not_found, invalid_input (truncated, damaged, other values, files of
// a folder on different voxels, no structure at all), unsupported (fractional or compressed DICOM SEG, colours),
// exhausted, cancelled, internal.
[[nodiscard]] Result<LabelMap> read_label_map(const std::filesystem::path& input, const KeepGoing& keep_going);

}  // namespace osteon::import
