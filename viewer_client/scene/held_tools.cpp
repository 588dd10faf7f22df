#include "viewer_client/scene/held_tools.hpp"

#include <algorithm>

namespace osteon {

namespace {

// Null: nobody knows the author.
const PersonSeen* holder_of(const CuttingState& state, std::span<const PersonSeen> people) {
  const auto found = std::ranges::find(people, state.author, &PersonSeen::author);
  return found != people.end() ? &*found : nullptr;
}

bool is_own(const PersonSeen* person, std::string_view own_name) {
  return person != nullptr && person->hand && !own_name.empty() && person->name == own_name;
}

}  // namespace

bool is_left_over(const CuttingState& state, std::span<const PersonSeen> people) {
  const PersonSeen* person = holder_of(state, people);
  return person != nullptr && person->hand && !person->here && state.phase == CuttingPhase::idle &&
         state.spindle_rpm == 0.0;
}

std::vector<HeldTool> held_tools(std::span<const CuttingState> states, std::span<const PersonSeen> people,
                                 std::string_view own_name) {
  std::vector<HeldTool> held;
  for (const CuttingState& state : states) {
    if (state.tool_name.empty() || is_left_over(state, people)) continue;
    const PersonSeen* person = holder_of(state, people);
    HeldTool& tool = held.emplace_back(HeldTool{state, {}});
    if (is_own(person, own_name)) continue;
    const bool named = person != nullptr && !person->name.empty();
    tool.holder = named ? person->name : "#" + std::to_string(state.author.value);
  }
  return held;
}

const CuttingState* first_held(std::span<const CuttingState> states, std::span<const PersonSeen> people) {
  const auto held = std::ranges::find_if(
      states, [&](const CuttingState& state) { return !state.tool_name.empty() && !is_left_over(state, people); });
  return held != states.end() ? &*held : nullptr;
}

const CuttingState* own_state(std::span<const CuttingState> states, std::span<const PersonSeen> people,
                              std::string_view own_name) {
  const auto found = std::ranges::find_if(states, [&](const CuttingState& state) {
    return is_own(holder_of(state, people), own_name) && !is_left_over(state, people);
  });
  return found != states.end() ? &*found : nullptr;
}

}  // namespace osteon
