// The text that the viewer shows beside the picture about a tool.
#pragma once
#include <string>

#include "common/mechanics/cutting_state.hpp"

namespace osteon {

// Lines: the tool and its activity, spindle speed, physical force, depth, metal in its way, full flutes, what the other
// hand does, density at the contact.
[[nodiscard]] std::string gauge_text(const CuttingState& state);

}  // namespace osteon
