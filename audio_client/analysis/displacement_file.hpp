// The displacement of a drill over time, from a table of comma-separated values.
#pragma once
#include <filesystem>
#include <vector>

#include "common/core/result.hpp"

namespace osteon::audio {

struct DisplacementRow {
  double time_s = 0;  // since the recording began
  double mm = 0;      // along the drill's axis, into the bone
};

// Reads the columns time_s and displacement_mm, or depth_mm as in a log of osteon-haptic --session-log. Other columns
// are ignored. `start_s`: the table's time when the recording began. Rows are in order of time. Errors: not_found,
// invalid_input; one sentence with file, line, column and remedy.
[[nodiscard]] Result<std::vector<DisplacementRow>> read_displacement(const std::filesystem::path& file, double start_s);

}  // namespace osteon::audio
