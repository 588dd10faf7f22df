// The plan of a simulated surgeon as JSON: {"steps": [{"action": "drill" | "burr" | "screw" | "place" | "wait", ...}]}.
#pragma once
#include <filesystem>
#include <vector>

#include "common/core/result.hpp"
#include "haptic_client/control/surgeon.hpp"

namespace osteon::haptic {

// What can be said of a tool's force law before a room is joined: whether the law, if one is named, is there, and suits
// the tool if the box has it. A tool that is not of the box may be the room's own. Error invalid_input.
[[nodiscard]] Result<void> check_law(const std::string& tool, const std::string& law);

// Tools are not looked for: they are the room's. Errors: not_found (no such file), invalid_input (names file, step and
// field).
[[nodiscard]] Result<std::vector<PlanStep>> read_plan(const std::filesystem::path& file);

}  // namespace osteon::haptic
