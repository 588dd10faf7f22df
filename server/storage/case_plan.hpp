// Reads what a case says beside its bone, for programs that show it.
#pragma once
#include <filesystem>

#include "common/core/result.hpp"
#include "common/surface/surgical_plan.hpp"
#include "common/volume/case.hpp"

namespace osteon {

// Planned axes, planes and boxes; each label that is no bone; and each region that is a label. The scan in the case's
// folder is read only if there is such a label. Any thread. Errors: those of load_scan(); exhausted (the surfaces have
// more than kMostPlanTriangles).
[[nodiscard]] Result<SurgicalPlan> load_plan(const std::filesystem::path& folder, const Case& bone);

}  // namespace osteon
