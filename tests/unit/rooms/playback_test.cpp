#include "server/rooms/playback.hpp"

#include <gtest/gtest.h>

#include <deque>

#include "tests/unit/room/cuts.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

Playback of(std::deque<std::chrono::nanoseconds> times, double speed) {
  std::uint64_t seq = 0;
  return {[times, seq]() mutable -> std::optional<LogEntry> {
            if (times.empty()) return {};
            LogEntry entry{.seq = RoomSeq{++seq}, .at = times.front(), .author = {}, .what = MarkEntry{"now"}};
            times.pop_front();
            return entry;
          },
          speed};
}

// Log entries of 10 s, 12 s and 16 s, in a room that was at 10 s when somebody began to watch.
TEST(Player, GivesLogEntriesAtTheirTimesOverItsSpeed) {
  for (const double speed : {0.5, 1.0, 4.0}) {
    Player player(of({10s, 12s, 16s}, speed), 10s);
    const auto at = [&](double s) {
      return 100s + std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * s / speed));
    };
    ASSERT_TRUE(player.take(at(0.0)));
    EXPECT_FALSE(player.take(at(1.99)));
    const auto second = player.take(at(2.01));
    ASSERT_TRUE(second);
    EXPECT_EQ(second->seq.value, 2u);
    EXPECT_FALSE(player.take(at(5.99)));
    EXPECT_TRUE(player.take(at(6.01)));
    EXPECT_FALSE(player.take(at(1000.0)));
  }
}

TEST(Player, StandsStillAndStops) {
  Player still(of({1s, 2s}, 0.0), 0s);
  EXPECT_FALSE(still.take(0s));
  EXPECT_FALSE(still.take(100000s));
  Player stopped(of({1s, 2s}, 1.0), 0s);
  (void)stopped.take(0s);
  ASSERT_TRUE(stopped.take(1500ms));
  ASSERT_FALSE(stopped.take(1600ms)) << "the entry of 2 s is not due yet";
  stopped.stop();
  EXPECT_FALSE(stopped.take(20s));
}

TEST(Player, ATrailOfCutsIsSeenAtWorkAndThenOnceAtRest) {
  Player player(of({}, 1.0), 0s);
  const auto tools = builtin_tool_box();
  const std::vector<Cut> cuts = test::strokes(AuthorId{3}, 2, 1);
  std::uint64_t newest = 0;
  for (int i = 0; i < 2; ++i) {
    const auto seen = player.see(cuts[static_cast<std::size_t>(i)], *tools, i * 200ms);
    ASSERT_TRUE(seen);
    EXPECT_GT(seen->state_seq, newest);
    newest = seen->state_seq;
    EXPECT_EQ(seen->phase, CuttingPhase::cutting);
    EXPECT_EQ(seen->author, AuthorId{3});
    EXPECT_TRUE(player.at_rest(i * 200ms + 100ms).empty());
  }
  EXPECT_TRUE(player.at_rest(400ms).empty()) << "200 ms after the last cut";
  const std::vector<CuttingState> rested = player.at_rest(500ms);
  ASSERT_EQ(rested.size(), 1u);
  EXPECT_EQ(rested[0].phase, CuttingPhase::idle);
  EXPECT_EQ(rested[0].spindle_rpm, 0.0);
  EXPECT_EQ(rested[0].tool_name, "drill-3.2");
  EXPECT_GT(rested[0].state_seq, newest) << "readers take only newer states";
  EXPECT_TRUE(player.at_rest(600ms).empty());
  Cut next = cuts[1];
  ++next.author_seq;
  const auto again = player.see(next, *tools, 650ms);
  ASSERT_TRUE(again);
  EXPECT_GT(again->state_seq, rested[0].state_seq);
  Cut unknown = cuts[0];
  unknown.tool = Digest{};
  EXPECT_FALSE(player.see(unknown, *tools, 700ms));
}

}  // namespace
}  // namespace osteon
