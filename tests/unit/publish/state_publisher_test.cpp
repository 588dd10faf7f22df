#include "server/publish/state_publisher.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "common/wire/convert.hpp"
#include "osteon/v1/cutting.pb.h"
#include "tests/support/wait.hpp"

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

// One client sends by its stream and by datagrams. The copy that arrives later is old, or known.
TEST(StatePublisher, AStateThatIsNotNewerIsIgnored) {
  CuttingState state;
  state.author = AuthorId{7};
  state.tool_name = "drill-3.2";
  StatePublisher publisher;
  const auto send = [&](std::uint64_t state_seq, double spindle_rpm) {
    state.state_seq = state_seq;
    state.spindle_rpm = spindle_rpm;
    publisher.update(state);
    publisher.publish(RoomSeq{1});
    return shown_by(publisher).spindle_rpm;
  };
  EXPECT_EQ(send(50, 1000), 1000.0);
  EXPECT_EQ(send(49, 900), 1000.0) << "older";
  EXPECT_EQ(send(50, 900), 1000.0) << "known";
  EXPECT_EQ(send(51, 1100), 1100.0);
  publisher.session_over(state.author);
  EXPECT_EQ(send(1, 1200), 1200.0) << "a new session counts from the start";
}

constexpr std::chrono::seconds kPatience{20};

CuttingState state_of(AuthorId author, std::uint64_t state_seq) {
  CuttingState state;
  state.author = author;
  state.state_seq = state_seq;
  return state;
}

// What a reader was sent, as the sum of the tools' sequence numbers, so that every new state changes it.
class SumReader : public StateSubscriber {
 public:
  void enqueue(const ShownNow& now) override {
    v1::WatchCuttingResponse message;
    ASSERT_TRUE(message.ParseFromString(*now.tools));
    std::uint64_t sum = 0;
    for (const v1::CuttingState& state : message.states()) sum += state.state_seq();
    ++messages;
    sum_of_newest = sum;
  }
  void end(const std::string&) override {}
  [[nodiscard]] std::size_t waiting() const override { return 0; }
  // False: it did not come.
  [[nodiscard]] bool comes(std::uint64_t sum) const {
    return test::wait_until([&] { return sum_of_newest == sum; }, kPatience);
  }
  std::atomic<std::uint64_t> messages{0}, sum_of_newest{0};
};

// Up to a number between two ticks, whoever they are of. Of those that come faster, the tick sends the newest.
TEST(StatePublisher, AStateDoesNotWaitForTheTick) {
  constexpr std::uint64_t kSoon = StatePublisher::kSoonPerTick;
  SumReader reader;
  StatePublisher publisher;
  publisher.watch(reader);
  std::uint64_t sum = 0;
  for (int tick = 0; tick < 3; ++tick) {
    for (std::uint64_t author = 1; author <= kSoon; ++author) {
      publisher.update(state_of(AuthorId{author}, static_cast<std::uint64_t>(tick) + 1));
      publisher.publish_soon(RoomSeq{1});
      ASSERT_TRUE(reader.comes(++sum)) << "tool " << author << " in tick " << tick;
    }
    publisher.publish(RoomSeq{1});
  }
  EXPECT_EQ(reader.messages, 3 * kSoon) << "the ticks had nothing more to send";
}

TEST(StatePublisher, HasABoundOfMessagesBetweenTwoTicks) {
  constexpr std::uint64_t kSoon = StatePublisher::kSoonPerTick, kMany = 10 * kSoon;
  SumReader reader;
  StatePublisher publisher;
  publisher.watch(reader);
  for (std::uint64_t seq = 1; seq <= kMany; ++seq) {
    publisher.update(state_of(AuthorId{7}, seq));
    publisher.publish_soon(RoomSeq{1});
    ASSERT_TRUE(seq > kSoon || reader.comes(seq));
  }
  publisher.stop();  // sends what is due
  EXPECT_EQ(reader.sum_of_newest, kSoon);
  EXPECT_EQ(reader.messages, kSoon);
}

// What comes while the publisher's thread is busy is sent with what came before.
TEST(StatePublisher, LosesNoState) {
  constexpr std::uint64_t kStates = 2000, kAuthors = 4;
  SumReader reader;
  StatePublisher publisher;
  publisher.watch(reader);
  {
    std::vector<std::jthread> hands;
    for (std::uint64_t author = 1; author <= kAuthors; ++author)
      hands.emplace_back([&publisher, author] {
        for (std::uint64_t seq = 1; seq <= kStates; ++seq) {
          publisher.update(state_of(AuthorId{author}, seq));
          publisher.publish_soon(RoomSeq{seq});
        }
      });
    for (int tick = 0; tick < 500; ++tick) publisher.publish(RoomSeq{1});
  }
  publisher.publish(RoomSeq{kStates});
  publisher.stop();
  EXPECT_EQ(reader.sum_of_newest, kAuthors * kStates);
}

}  // namespace
}  // namespace osteon
