#include "server/publish/state_publisher.hpp"

#include <gtest/gtest.h>

#include "common/wire/convert.hpp"
#include "osteon/v1/cutting.pb.h"

namespace osteon {
namespace {

class StateReader : public StateSubscriber {
 public:
  void enqueue(const ShownNow& now) override { newest = now; }
  void end(const std::string&) override {}
  [[nodiscard]] std::size_t waiting() const override { return 0; }
  ShownNow newest;
};

// Of the only tool, as a reader sees it who comes now.
CuttingState shown_by(StatePublisher& publisher) {
  StateReader reader;
  publisher.watch(reader);
  publisher.leave(reader);
  v1::WatchCuttingResponse message;
  EXPECT_TRUE(reader.newest.tools && message.ParseFromString(*reader.newest.tools));
  EXPECT_EQ(message.states_size(), 1);
  return message.states_size() == 1 ? wire::from_wire(message.states(0)).value_or(CuttingState{}) : CuttingState{};
}

// Nobody holds it any more: it turns, pushes, sounds and is washed no longer, and stays where it was.
TEST(StatePublisher, TheToolOfAnEndedSessionRests) {
  CuttingState state;
  state.author = AuthorId{7};
  state.state_seq = 3;
  state.pose_bone_tool.position_mm = {1, 2, 3};
  state.tool_name = "drill-3.2";
  state.spindle_rpm = 1000;
  state.feed_mm_per_s = 2;
  state.density_g_cm3 = 1.9;
  state.engaged_fraction = 0.5;
  state.force_physical_N = {0, 0, 9};
  state.torque_Nmm = 8;
  state.depth_mm = 4;
  state.cortex_mm = 5;
  state.blows = 6;
  state.phase = CuttingPhase::cutting;
  state.force_hand_N = 9.6;
  state.device_holds_N = 30;
  state.on_metal = state.irrigation = state.suction = true;
  StatePublisher publisher;
  publisher.update(state);
  publisher.publish(RoomSeq{1});
  EXPECT_DOUBLE_EQ(shown_by(publisher).force_hand_N, 9.6);
  EXPECT_TRUE(shown_by(publisher).suction);

  publisher.session_over(state.author);
  publisher.publish(RoomSeq{2});
  const CuttingState rests = shown_by(publisher);
  EXPECT_GT(rests.state_seq, state.state_seq);
  EXPECT_EQ(rests.phase, CuttingPhase::idle);
  EXPECT_EQ(rests.pose_bone_tool.position_mm, state.pose_bone_tool.position_mm);
  EXPECT_EQ(rests.tool_name, state.tool_name);
  EXPECT_EQ(rests.force_physical_N, Vec3::Zero());
  for (const double none : {rests.spindle_rpm, rests.feed_mm_per_s, rests.density_g_cm3, rests.engaged_fraction,
                            rests.torque_Nmm, rests.force_hand_N, rests.device_holds_N, rests.cortex_mm})
    EXPECT_EQ(none, 0.0);
  EXPECT_EQ(rests.blows, 6u) << "a blow that comes with the end is heard";
  EXPECT_FALSE(rests.on_metal || rests.irrigation || rests.suction);
  EXPECT_TRUE(publisher.tool_tips_mm().empty());
}

// A state that comes alone is sent at once. Of those that come closer together than ticks, the tick sends the newest.
TEST(StatePublisher, AStateDoesNotWaitForTheTick) {
  const StatePublisher::Clock::time_point begin{std::chrono::seconds{100}};
  StatePublisher publisher;
  const auto came = [&](std::uint64_t state_seq, std::chrono::nanoseconds after) {
    CuttingState state;
    state.author = AuthorId{7};
    state.state_seq = state_seq;
    publisher.update(state);
    publisher.publish_soon(RoomSeq{1}, begin + after);
    return shown_by(publisher).state_seq;
  };
  EXPECT_EQ(came(1, {}), 1U);
  EXPECT_EQ(came(2, StatePublisher::kApart / 2), 1U);
  EXPECT_EQ(came(3, StatePublisher::kApart * 3 / 4), 1U);
  publisher.publish(RoomSeq{1}, begin + StatePublisher::kApart * 7 / 8);
  EXPECT_EQ(shown_by(publisher).state_seq, 3U);
  EXPECT_EQ(came(4, StatePublisher::kApart), 3U) << "the tick has just sent one";
  EXPECT_EQ(came(5, 2 * StatePublisher::kApart), 5U);
}

}  // namespace
}  // namespace osteon
