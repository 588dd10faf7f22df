// Tests the telemetry thread without a server: what it notes of the ticks' rows, and what it sends to the room.
#include "haptic_client/app/telemetry_worker.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "tests/support/wait.hpp"
#include "tests/unit/haptic_client/app/fake_room.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

using namespace std::chrono_literals;
using osteon::test::wait_until;

// A session that has left one item on the bone.
class LeavingSession final : public Session {
 public:
  explicit LeavingSession(const Case& bone) : session_(session_of({straight_down("drill-3.2")}, bone)) {
    item_.pose_bone_item.position_mm = Vec3(1, 2, 3);
    left_.push_back(item_);
  }
  SessionTick tick(const Patch& patch, RoomLink room, int periods,
                   const std::vector<PlacedGuide>* room_guides) noexcept override {
    return session_.tick(patch, room, periods, room_guides);
  }
  [[nodiscard]] bool done() const noexcept override { return session_.done(); }
  [[nodiscard]] HapticLoop& loop() noexcept override { return session_.loop(); }
  [[nodiscard]] const ReadyPlan& plan() const noexcept override { return session_.plan(); }
  [[nodiscard]] const std::vector<StepResult>& results() const noexcept override { return session_.results(); }
  [[nodiscard]] const std::vector<PlacedItem>& left() const noexcept override { return left_; }
  [[nodiscard]] const HapticDevice& device() const noexcept override { return session_.device(); }

 private:
  SimulatedSession session_;
  PlacedItem item_;
  std::vector<PlacedItem> left_;
};

class TelemetryWorkerTest : public testing::Test {
 protected:
  void push(std::uint64_t seq, std::uint32_t events, double force_n, double guide_mm = 0.0) {
    TickRow row;
    row.mono_ns = static_cast<std::int64_t>(1'000'000 * seq);
    row.report.state_seq = seq;
    row.report.events = events;
    row.report.guidance.distance_mm = guide_mm;
    row.force_rendered_n = force_n;
    ASSERT_TRUE(exchange_.rows.try_push(row));
  }
  void run_to_the_end() {
    worker_.finish();
    worker_.run();
  }

  const Case bone_ = block_case();
  FakeRoom room_;
  LeavingSession session_{bone_};
  SessionLog log_;
  Recorder recorder_;
  WorkerExchange exchange_;
  ClientEnd end_;
  TelemetryWorker worker_{client_room(room_, bone_), session_, false, log_, recorder_, exchange_, end_};
};

TEST_F(TelemetryWorkerTest, NotesWhatRestrictionsDoToTheMillisecond) {
  push(1, 0, 1.0);
  push(2, kForbidden, 1.5);
  push(3, kForbidden, 1.7);
  push(4, kHandGuided, 1.0, 8.0);
  push(5, kHandGuided, 1.1, 5.0);
  push(6, 0, 9.0);
  run_to_the_end();
  const TelemetryOutcome outcome = worker_.outcome();
  const std::vector<std::pair<std::int64_t, std::string>> expected{
      {2, "may not cut"}, {4, "may cut"}, {4, "is led"}, {6, "is no longer led"}};
  ASSERT_EQ(outcome.effects.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(outcome.effects[i].mono_ns, 1'000'000 * expected[i].first);
    EXPECT_EQ(outcome.effects[i].what, expected[i].second);
  }
  EXPECT_EQ(outcome.forbidden_ticks, 2u);
  EXPECT_DOUBLE_EQ(outcome.supervised_step_n, 0.5) << "the last row's step was not under a restriction";
  EXPECT_DOUBLE_EQ(outcome.guide_mm, 5.0);
  EXPECT_DOUBLE_EQ(outcome.guide_most_mm, 8.0);
}

TEST_F(TelemetryWorkerTest, SendsTheNewestStateOfManyRows) {
  for (std::uint64_t seq = 1; seq <= 5; ++seq) push(seq, 0, 0.5 * static_cast<double>(seq));
  exchange_.mount_loads.store(MountLoad{});
  run_to_the_end();
  ASSERT_EQ(room_.states.size(), 1u);
  EXPECT_EQ(room_.states[0].state_seq, 5u);
  EXPECT_EQ(room_.states[0].author, AuthorId{7});
  EXPECT_EQ(room_.states[0].tool_name, "drill-3.2");
  EXPECT_EQ(room_.states[0].force_hand_N, 2.5);
  EXPECT_EQ(room_.states[0].device_holds_N, 30.0) << "as for --device simulated";
  EXPECT_EQ(room_.loads.size(), 1u);
  EXPECT_DOUBLE_EQ(exchange_.line_lag_s, 0.04);
}

TEST_F(TelemetryWorkerTest, SendsWhatTheSoundNeeds) {
  TickRow row;
  row.mono_ns = 123'456;
  row.cortex_mm = 4.5;
  row.report.state_seq = 1;
  row.report.cutting.seated = 0.75;
  row.report.cutting.blows = 9;
  row.report.cutting.blow_impulse_n_s = 2.8;
  ASSERT_TRUE(exchange_.rows.try_push(row));
  run_to_the_end();
  ASSERT_EQ(room_.states.size(), 1u);
  EXPECT_EQ(room_.states[0].time_ns, 123'456);
  EXPECT_EQ(room_.states[0].cortex_mm, 4.5);
  EXPECT_EQ(room_.states[0].seated, 0.75);
  EXPECT_EQ(room_.states[0].blows, 9u);
  EXPECT_EQ(room_.states[0].blow_impulse_N_s, 2.8);
}

TEST_F(TelemetryWorkerTest, SendsNothingAfterTheClientsEnd) {
  end_.give_up({ErrorCode::unavailable, "gone"});
  push(1, kForbidden, 0.0);
  exchange_.mount_loads.store(MountLoad{});
  exchange_.items_left = 1;
  run_to_the_end();
  EXPECT_TRUE(room_.states.empty());
  EXPECT_TRUE(room_.loads.empty());
  EXPECT_EQ(room_.item_calls, 0);
  EXPECT_EQ(worker_.outcome().forbidden_ticks, 1u) << "its rows still count";
}

TEST_F(TelemetryWorkerTest, PlacesAnItemAgainAfterItWasDenied) {
  room_.deny_items = 1;
  std::thread thread([this] { worker_.run(); });
  const auto began = std::chrono::steady_clock::now();
  exchange_.items_left = 1;
  EXPECT_TRUE(wait_until([this] { return room_.item_calls == 2; }, 20s));
  EXPECT_GE(std::chrono::steady_clock::now() - began, 2s);
  worker_.finish();
  thread.join();
  ASSERT_EQ(room_.items.size(), 1u);
  EXPECT_EQ(room_.items[0].pose_bone_item.position_mm, Vec3(1, 2, 3));
  EXPECT_FALSE(end_.lost());
}

TEST_F(TelemetryWorkerTest, EndsTheClientWhenAnItemCannotBePlaced) {
  room_.deny_items = 1;
  room_.item_error = ErrorCode::unavailable;
  exchange_.items_left = 1;
  run_to_the_end();
  ASSERT_TRUE(end_.lost());
  EXPECT_EQ(end_.why()->code, ErrorCode::unavailable);
  EXPECT_EQ(room_.item_calls, 1);
}

}  // namespace
}  // namespace osteon::haptic::test
