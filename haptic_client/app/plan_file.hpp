// The plan of a simulated surgeon as JSON: {"steps": [{"action": "drill" | "burr" | "screw" | "place" | "wait", ...}]}.
#pragma once
#include <filesystem>
#include <vector>

#include "common/core/result.hpp"
#include "haptic_client/simulation/surgeon.hpp"

namespace osteon::haptic {

// Checks a tool's force law before a room is joined, as far as possible. A named law must exist, and must suit the tool
// if the tool box has the tool. Another tool may be the room's own. Error invalid_input.
[[nodiscard]] Result<void> check_law(const std::string& tool, const std::string& law);

// Does not search for tools: they are the room's. Errors: not_found (no such file), invalid_input (names file, step and
// field).
[[nodiscard]] Result<std::vector<PlanStep>> read_plan(const std::filesystem::path& file);

}  // namespace osteon::haptic
