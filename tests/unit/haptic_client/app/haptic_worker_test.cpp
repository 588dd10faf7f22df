// Tests the 1 kHz thread without a server: its rows, its end, and that it does not allocate.
#include "haptic_client/app/haptic_worker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "tests/support/allocation_counter.hpp"
#include "tests/unit/haptic_client/app/fake_room.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

using osteon::test::AllocationCounter;

struct HapticRun {
  explicit HapticRun(const std::vector<PlanStep>& plan) : session(session_of(plan, bone)) {}

  const Case bone = block_case();
  SimulatedSession session;
  WorkerExchange exchange;
  ClientEnd end;
  StopSignal stop;
  HapticWorker worker{session, Vec3::Zero(), exchange, end, stop};
};

// A session whose third tick stalls for 20 ms. So the fourth is late by about 20 periods.
class StallingSession final : public Session {
 public:
  StallingSession(Session& inner, bool simulated_time) : inner_(inner), simulated_time_(simulated_time) {}
  SessionTick tick(const Patch& patch, RoomLink room, int periods,
                   const std::vector<PlacedGuide>* room_guides) noexcept override {
    longest_wait_ = std::max(longest_wait_, periods);
    if (++ticks_ == 3) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return inner_.tick(patch, room, periods, room_guides);
  }
  [[nodiscard]] bool simulated_time() const noexcept override { return simulated_time_; }
  [[nodiscard]] bool done() const noexcept override { return inner_.done(); }
  [[nodiscard]] HapticLoop& loop() noexcept override { return inner_.loop(); }
  [[nodiscard]] const ReadyPlan& plan() const noexcept override { return inner_.plan(); }
  [[nodiscard]] const std::vector<StepResult>& results() const noexcept override { return inner_.results(); }
  [[nodiscard]] const std::vector<PlacedItem>& left() const noexcept override { return inner_.left(); }
  [[nodiscard]] const HapticDevice& device() const noexcept override { return inner_.device(); }
  [[nodiscard]] int longest_wait() const { return longest_wait_; }  // ms, as the session was told

 private:
  Session& inner_;
  bool simulated_time_;
  int ticks_ = 0, longest_wait_ = 0;
};

std::vector<TickRow> rows_of(WorkerExchange& exchange) {
  std::vector<TickRow> rows;
  for (TickRow row; exchange.rows.try_pop(row);) rows.push_back(row);
  return rows;
}

TEST(HapticWorker, PassesOnARowOfEachTickAndDoesNotAllocate) {
  const auto run = std::make_unique<HapticRun>(std::vector{wait_for(0.2)});
  const AllocationCounter heap;
  run->worker.run();
  EXPECT_EQ(heap.count(), 0);
  const HapticOutcome outcome = run->worker.outcome();
  const std::vector<TickRow> rows = rows_of(run->exchange);
  ASSERT_EQ(rows.size(), outcome.ticks.work.count());
  EXPECT_GE(rows.size(), 200u);
  EXPECT_EQ(outcome.rows_dropped, 0u);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].report.state_seq, i + 1);
    EXPECT_EQ(rows[i].mono_ns, run->exchange.tick_times.of(i + 1));
  }
  EXPECT_GE(rows.front().mono_ns, outcome.began_ns);
}

TEST(HapticWorker, RunsDownForHalfASecondAfterTheClientsEnd) {
  const auto run = std::make_unique<HapticRun>(std::vector{straight_down("drill-3.2")});
  run->end.give_up({ErrorCode::unavailable, "gone"});
  run->worker.run();
  EXPECT_FALSE(run->session.done());
  EXPECT_EQ(run->worker.outcome().ticks.work.count(), 500u);
  const std::vector<TickRow> rows = rows_of(run->exchange);
  ASSERT_EQ(rows.size(), 500u);
  for (const TickRow& row : rows) EXPECT_TRUE(row.report.events & kRoomHeld);
  EXPECT_EQ(rows.back().force_rendered_n, 0.0);
}

TEST(HapticWorker, CountsLateTicksForADeviceButNotForASimulatedHand) {
  for (const bool simulated_time : {false, true}) {
    const auto run = std::make_unique<HapticRun>(std::vector{wait_for(0.05)});
    EXPECT_TRUE(run->session.simulated_time());
    StallingSession session(run->session, simulated_time);
    HapticWorker worker(session, Vec3::Zero(), run->exchange, run->end, run->stop);
    worker.run();
    EXPECT_GE(worker.outcome().ticks.missed, 15u) << "the machine did stall";
    if (simulated_time)
      EXPECT_EQ(session.longest_wait(), 1);
    else
      EXPECT_GE(session.longest_wait(), 15);
  }
}

TEST(HapticWorker, HoldsTheSpindleWhileTheRoomDoesNotFollow) {
  const auto run = std::make_unique<HapticRun>(std::vector{wait_for(0.05)});
  run->exchange.room_health = RoomHealth::silent;
  run->worker.run();
  const HapticOutcome outcome = run->worker.outcome();
  EXPECT_EQ(outcome.held_for_room_ticks, outcome.ticks.work.count());
}

TEST(HapticWorker, DropsAndCountsRowsThatNobodyTakes) {
  const auto run = std::make_unique<HapticRun>(std::vector{wait_for(2.5)});
  run->worker.run();
  const HapticOutcome outcome = run->worker.outcome();
  EXPECT_EQ(rows_of(run->exchange).size() + outcome.rows_dropped, outcome.ticks.work.count());
  EXPECT_GT(outcome.rows_dropped, 0u);
  EXPECT_TRUE(run->exchange.tick_stats.refresh());
}

}  // namespace
}  // namespace osteon::haptic::test
