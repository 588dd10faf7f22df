// The YAML file in which a person writes points that two scans share.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/imaging/landmark_fit.hpp"

namespace osteon::import {

struct NamedLandmark {
  std::string name;  // for the person alone; "landmark 3" if the file has none
  imaging::LandmarkPair at;
};

// landmarks: a list with the fields fixed_mm and moving_mm, and a name if one likes. Positions are [x, y, z] in mm, LPS
// of the fixed and of the moving scan, within 100 m. Errors: invalid_input (also fewer than 3, more than 1000, or two
// of one name). They name the file, the landmark, the field and the remedy.
[[nodiscard]] Result<std::vector<NamedLandmark>> parse_landmarks(std::string_view text, const std::string& file_name);

// Errors: not_found, unavailable (no permission), invalid_input (longer than 1 MiB) too.
[[nodiscard]] Result<std::vector<NamedLandmark>> read_landmarks(const std::filesystem::path& file);

}  // namespace osteon::import
