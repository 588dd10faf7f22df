// The files of a registration: the transform, and the moving scan and its labels on the fixed scan's voxels.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/import/label_map.hpp"
#include "server/import/scan_registration.hpp"

namespace osteon::import {

inline constexpr const char* kTransformFile = "registration.json";
inline constexpr const char* kMovedScanFile = "moving.nii.gz";
inline constexpr const char* kMovedLabelsFile = "labels.nii.gz";

// The labels of a map as one number for each voxel.
struct DrawnLabels {
  imaging::HuVolume grid;  // without values
  std::vector<std::uint16_t> values;
  std::vector<std::pair<int, std::string>> names;  // of numbers whose structures have a name
};

// A structure keeps its number, unless the map has none or another structure has it already. Error: invalid_input (two
// structures in one voxel, or a map that does not lie on the moving scan).
[[nodiscard]] Result<DrawnLabels> draw_labels(const LabelMap& map, const imaging::HuVolume& moving);

// Makes the folder with registration.json, moving.nii.gz, and labels.nii.gz if there are labels. No file has a name, a
// date or a path. Errors: exists, cancelled, internal (disk).
[[nodiscard]] Result<void> write_registration(const std::filesystem::path& folder, const ScanRegistration& registration,
                                              const imaging::HuVolume& fixed, const imaging::HuVolume& moving,
                                              const std::optional<DrawnLabels>& labels, const KeepGoing& keep_going);

}  // namespace osteon::import
