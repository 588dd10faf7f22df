// A list of cuts that a person writes, to try tools on a bone without a room.
//
//   steps:
//     - {tool: burr-round-5, from: [10, 0, 5], to: [20, 0, 5], axis: [0, 0, -1]}
//     - tool: my-saw.yaml            # a name of the tool box, or a tool file beside the script
//       path:                        # poses that the tool goes through; `axis` points out of the tip
//         - {at: [0, 0, 0], axis: [0, 0, -1], across: [1, 0, 0]}
//         - {at: [0, 8, -6], axis: [0, 0, -1], across: [1, 0, 0]}
//       level: 1                     # default: the tool's own
//
// `across` is the direction of a blade's width. It may be omitted for round tools. Millimetres in the bone's frame.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"
#include "common/tools/tool.hpp"

namespace osteon::import {

struct CarveStep {
  Tool tool;
  std::vector<Pose> path;    // pose_bone_tool, at least one
  std::optional<int> level;  // as requested; the case and the tool limit it
};

// Errors: not_found, invalid_input; each names the file and the step.
[[nodiscard]] Result<std::vector<CarveStep>> read_carve_script(const std::filesystem::path& file);

// A tool by its name in the tool box, or from a file with the ending .yaml. A relative path starts at `folder`.
[[nodiscard]] Result<Tool> tool_named(const std::string& name, const std::filesystem::path& folder);

}  // namespace osteon::import
