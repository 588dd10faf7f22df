// The plan of a simulated surgeon as JSON: {"steps": [{"action": "drill" | "burr" | "screw" | "place" | "wait", ...}]}.
#pragma once
#include <filesystem>
#include <vector>

#include "common/core/result.hpp"
#include "haptic_client/control/surgeon.hpp"

namespace osteon::haptic {

// Errors: not_found (no such file), invalid_input (names file, step and field).
[[nodiscard]] Result<std::vector<PlanStep>> read_plan(const std::filesystem::path& file);

}  // namespace osteon::haptic
