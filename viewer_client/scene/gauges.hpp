// What the viewer writes beside the picture about a tool.
#pragma once
#include <string>

#include "common/mechanics/cutting_state.hpp"

namespace osteon {

// Lines: tool and what it does, spindle speed, physical force, depth, metal in its way, density where it touches.
[[nodiscard]] std::string gauge_text(const CuttingState& state);

}  // namespace osteon
