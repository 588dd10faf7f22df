// A tool's state in few bytes, for every packet: the pose in the integers of cuts, the effort now and then.
#pragma once
#include <cstdint>

#include "common/core/result.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "osteon/v1/link.pb.h"

namespace osteon::wire {

// `with_effort`: also force, feed and the like. Gauges and sound need them only at their own, lower rate.
[[nodiscard]] v1::ToolState to_tool_state(const CuttingState& state, std::uint32_t buttons, bool with_effort);

struct KnownToolState {
  CuttingState state;
  std::uint32_t buttons = 0;
};
// Merges a newer state into the known state of the tool. What is not sent stays as it was. False if it is not newer.
// Error invalid_input, naming the field, for what a correct peer never sends; then nothing has changed.
[[nodiscard]] Result<bool> take_over(const v1::ToolState& sent, KnownToolState& known);

}  // namespace osteon::wire
