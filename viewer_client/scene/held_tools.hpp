// The tools that people hold now, and whose they are, for the texts of a window.
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/mechanics/cutting_state.hpp"
#include "viewer_client/scene/supervision_client.hpp"

namespace osteon {

struct HeldTool {
  CuttingState state;
  std::string holder;  // as the picture names people, such as "#3" for one without a name; empty: the window's own user
  [[nodiscard]] bool own() const { return holder.empty(); }
};

// Whether this state is what a room still shows of a session that has ended: the haptic client is away, and the tool is
// at rest. In a room that is played nobody is there, but the tools move.
[[nodiscard]] bool is_left_over(const CuttingState& state, std::span<const PersonSeen> people);

// Without empty hands, and without what is_left_over(). `people`: those of the room, as far as they are known. A tool
// of an unknown author counts. `own_name`: the name of this window's hand; empty: it has none.
[[nodiscard]] std::vector<HeldTool> held_tools(std::span<const CuttingState> states, std::span<const PersonSeen> people,
                                               std::string_view own_name);

// The first of held_tools(). Null: there is none.
[[nodiscard]] const CuttingState* first_held(std::span<const CuttingState> states, std::span<const PersonSeen> people);

// The state of this window's hand, whether it is empty or not. Null: it has none, or it is not in the room yet.
[[nodiscard]] const CuttingState* own_state(std::span<const CuttingState> states, std::span<const PersonSeen> people,
                                            std::string_view own_name);

}  // namespace osteon
