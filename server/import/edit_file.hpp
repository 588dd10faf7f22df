// The YAML file in which a person writes corrections of labelled bones.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "server/import/label_edits.hpp"

namespace osteon::import {

// edits: a list, in the order of their replay. Each has a `kind` and the fields of that kind and no others:
//   paint     bone, centre_mm, radius_mm, and normal if it is a disc in one slice
//   scribble  bone, points_mm (2 to 1000), radius_mm, and normal likewise
//   erase     centre_mm or points_mm, radius_mm, and bone if only that one may change, and normal likewise
//   cut       bone, point_mm, normal, and to_bone if what is cut off is not removed
//   seed      point_mm, and bone if it is not the next number
//   outside   point_mm
//   box       corner_mm, opposite_mm; once in the list
//   label     bone, name, and opacity (0 to 1) and minutes; once for each bone
//   landmark  name, point_mm; once for each name
// Positions are [x, y, z] in mm, LPS, within 100 m; a radius is from 0.05 to 200 mm; a bone is a number from 1 to 254.
// Errors: invalid_input. They name the file, the edit, the field and the remedy.
[[nodiscard]] Result<std::vector<LabelEdit>> parse_edits(std::string_view text, const std::string& file_name);

// Errors: not_found, unavailable (no permission), invalid_input (longer than 1 MiB) too.
[[nodiscard]] Result<std::vector<LabelEdit>> read_edits(const std::filesystem::path& file);

}  // namespace osteon::import
