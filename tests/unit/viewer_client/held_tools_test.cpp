#include "viewer_client/scene/held_tools.hpp"

#include <gtest/gtest.h>

#include <span>
#include <vector>

namespace osteon {
namespace {

constexpr AuthorId kOurHand{3}, kTheirHand{4}, kDemonstrator{5};

PersonSeen hand_of(AuthorId author, const std::string& name, bool here) {
  PersonSeen person;
  person.author = author;
  person.name = name;
  person.here = here;
  person.hand = true;
  return person;
}

CuttingState drill_of(AuthorId author) {
  CuttingState state;
  state.author = author;
  state.tool_name = "drill-3.2";
  state.phase = CuttingPhase::idle;
  return state;
}

TEST(HeldTools, WhoHoldsTheSameToolIsToldApartAndTheWindowsOwnHandIsKnown) {
  const std::vector states{drill_of(kTheirHand), drill_of(kOurHand), drill_of(kDemonstrator)};
  const std::vector people{hand_of(kOurHand, "Ada", true), hand_of(kTheirHand, "Berg", true)};
  const auto held = held_tools(states, people, "Ada");
  ASSERT_EQ(held.size(), 3u);
  EXPECT_EQ(held[0].holder, "Berg");
  EXPECT_FALSE(held[0].own());
  EXPECT_TRUE(held[1].own());
  EXPECT_EQ(held[2].holder, "#5") << "nobody knows a name";
  ASSERT_NE(own_state(states, people, "Ada"), nullptr);
  EXPECT_EQ(own_state(states, people, "Ada")->author, kOurHand);
  // A window without a name of its own has no hand.
  EXPECT_EQ(own_state(states, people, ""), nullptr);
  EXPECT_EQ(held_tools(states, people, "")[1].holder, "Ada");
}

// The room goes on to show the tool of an ended session for ten seconds, at rest.
TEST(HeldTools, TheToolOfAnEndedSessionIsInNobodysHand) {
  const std::vector states{drill_of(kTheirHand), drill_of(kOurHand)};
  const std::vector people{hand_of(kOurHand, "Ada", true), hand_of(kTheirHand, "Berg", false)};
  const auto held = held_tools(states, people, "Ada");
  ASSERT_EQ(held.size(), 1u);
  EXPECT_TRUE(held[0].own());
  EXPECT_EQ(own_state(states, people, "Berg"), nullptr);
  EXPECT_EQ(first_held(states, people), &states[1]);
  EXPECT_EQ(first_held(std::span(states).first(1), people), nullptr);
  // Until the room says who is there, each tool counts.
  EXPECT_EQ(held_tools(states, {}, "Ada").size(), 2u);
  EXPECT_EQ(first_held(states, {}), &states[0]);
}

TEST(HeldTools, AToolThatMovesWithoutItsPersonIsOfARoomThatIsPlayed) {
  CuttingState moving = drill_of(kTheirHand);
  moving.phase = CuttingPhase::free;
  moving.spindle_rpm = 900.0;
  const std::vector people{hand_of(kTheirHand, "Berg", false)};
  EXPECT_EQ(held_tools(std::vector{moving}, people, "").size(), 1u);
}

TEST(HeldTools, AnEmptyHandHoldsNoToolButIsOurOwn) {
  CuttingState empty = drill_of(kOurHand);
  empty.tool_name.clear();
  const std::vector people{hand_of(kOurHand, "Ada", true)};
  EXPECT_TRUE(held_tools(std::vector{empty}, people, "Ada").empty());
  const std::vector states{empty};
  EXPECT_EQ(own_state(states, people, "Ada"), &states.front());
  EXPECT_EQ(first_held(states, people), nullptr);
}

}  // namespace
}  // namespace osteon
