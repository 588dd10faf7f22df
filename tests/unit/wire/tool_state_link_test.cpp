// Tests what the room hears of a tool whose packets are lost: what the sound needs must be right.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/wire/link_pair.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::LinkPair;

// A blow every 100 ms, and of three packets two are lost. The count that arrives last is right, and each blow is heard
// of within the packets that follow it.
TEST(ToolStateLink, BlowsSurviveLoss) {
  LinkPair pair;
  pair.run(1s);
  std::size_t packets = 0;
  pair.lost = [&](const v1::UpPacket&) { return ++packets % 3 != 0; };
  CuttingState state;
  state.phase = CuttingPhase::rubbing;
  std::uint32_t heard = 0;
  int behind_ms = 0, most_ms = 0;
  for (int i = 0; i < 4000; i += 4) {
    ++state.state_seq;
    state.time_ns = std::int64_t{i} * 1'000'000;
    if (i % 100 == 0 && i < 3500) ++state.blows;
    pair.client.set_state(state, 0);
    pair.run(4ms);
    if (const auto received = pair.server.take_state()) {
      EXPECT_GE(received->state.blows, heard);
      heard = received->state.blows;
    }
    behind_ms = heard == state.blows ? 0 : behind_ms + 4;
    most_ms = std::max(most_ms, behind_ms);
  }
  EXPECT_EQ(heard, 35u);
  EXPECT_LE(most_ms, 3 * 16 + 8);
}

// Away from the bone an effort, which names the tool, is rare. A broach that had more blows than the one before must
// not come with its count under the old name: that would be heard as a blow.
TEST(ToolStateLink, BlowsComeUnderTheNameOfTheirTool) {
  LinkPair pair;
  pair.run(1s);
  CuttingState state;
  state.phase = CuttingPhase::free;
  int changes = 0;
  std::string before;
  for (int i = 0; i < 500; ++i) {
    ++state.state_seq;
    const bool first = i / 3 % 2 == 0;
    state.tool_name = first ? "broach-1" : "broach-2";
    state.blows = first ? 3 : 40;
    pair.client.set_state(state, 0);
    pair.run(4ms);
    const auto received = pair.server.take_state();
    if (!received) continue;
    EXPECT_EQ(received->state.blows, received->state.tool_name == "broach-1" ? 3u : 40u);
    changes += received->state.tool_name != before;
    before = received->state.tool_name;
  }
  EXPECT_GT(changes, 20);
}

// Sound computes ahead from pairs of states: at the bone, the force of each must be of its time.
TEST(ToolStateLink, AtTheBoneEachStateHasItsEffort) {
  LinkPair pair;
  pair.run(1s);
  CuttingState state;
  state.phase = CuttingPhase::cutting;
  pair.ups.clear();
  int states = 0;
  for (int i = 0; i < 500; ++i) {
    ++state.state_seq;
    state.time_ns = std::int64_t{i} * 4'000'000;
    state.force_physical_N = {0, 0, 0.004 * i};
    state.pose_bone_tool.position_mm.z() = state.pose_bone_device.position_mm.z() = 0.1 * i;
    pair.client.set_state(state, 0);
    pair.run(4ms);
    const auto received = pair.server.take_state();
    if (!received) continue;
    ++states;
    EXPECT_NEAR(received->state.force_physical_N.z(), 1e-9 * static_cast<double>(received->state.time_ns), 1e-9);
  }
  EXPECT_GE(states, 2 * 50);
}

}  // namespace
}  // namespace osteon
