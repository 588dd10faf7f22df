// Tests the 1 kHz thread without a server: its rows, its end, and that it does not allocate.
#include "haptic_client/app/haptic_worker.hpp"

#include <gtest/gtest.h>

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
