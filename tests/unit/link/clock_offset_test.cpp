#include "common/link/clock_offset.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

namespace osteon {
namespace {

using namespace std::chrono_literals;
using Time = std::chrono::nanoseconds;

// A datagram that leaves at `sent`, takes `there` and `back`, and is held for `kept` by a peer whose clock is ahead.
ClockSample exchange(Time sent, Time there, Time kept, Time back, Time ahead) {
  return {sent, sent + there + ahead, sent + there + kept + ahead, sent + there + kept + back};
}

TEST(ClockOffset, IsExactWhereBothWaysTakeTheSame) {
  for (const Time ahead : {Time(0), Time(-5h), Time(123456789ns), Time(24h * 365)}) {
    ClockOffset clock;
    ASSERT_TRUE(clock.add(exchange(1s, 40ms, 7ms, 40ms, ahead)));
    const auto reading = clock.at(1s + 87ms);
    ASSERT_TRUE(reading);
    EXPECT_EQ(reading->offset, ahead);
    EXPECT_EQ(reading->round_trip, 80ms);
    EXPECT_EQ(reading->error, 40ms);
  }
}

TEST(ClockOffset, ErrsByHalfTheDifferenceOfTheWays) {
  ClockOffset clock;
  ASSERT_TRUE(clock.add(exchange(1s, 90ms, 0ms, 10ms, 3s)));
  EXPECT_EQ(clock.at(2s)->offset, 3s + 40ms);
}

// Queues that grow and empty differently on both ways. The true offset is always within the stated error, which is half
// of the shortest round trip of the kept samples.
TEST(ClockOffset, StaysWithinItsStatedErrorOnAnyNetwork) {
  Time worst{0};
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    std::mt19937_64 random(seed);
    const auto upto = [&](Time most) {
      return Time(static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(most.count() + 1)));
    };
    const Time ahead = upto(2h) - Time(1h), least_there = upto(50ms), least_back = upto(50ms);
    ClockOffset clock;
    std::vector<Time> round_trips;
    Time now = upto(1h);
    for (int i = 0; i < 60; ++i) {
      const Time there = least_there + upto(random() % 4 == 0 ? Time(300ms) : Time(5ms));
      const Time back = least_back + upto(random() % 4 == 0 ? Time(300ms) : Time(5ms));
      const ClockSample sample = exchange(now, there, upto(8ms), back, ahead);
      ASSERT_TRUE(clock.add(sample));
      round_trips.push_back(there + back);
      now = sample.received;
      const auto kept = std::min<long>(16, static_cast<long>(round_trips.size()));
      const Time least = *std::min_element(round_trips.end() - kept, round_trips.end());
      const auto reading = clock.at(now);
      ASSERT_TRUE(reading);
      EXPECT_EQ(reading->round_trip, least);
      EXPECT_LE(reading->error, least / 2 + 1ns);
      const Time off = std::chrono::abs(reading->offset - ahead);
      EXPECT_LE(off, reading->error) << "seed " << seed;
      worst = std::max(worst, Time(off * 1000 / reading->error.count()));
    }
  }
  // The bound is tight: some ways are as unequal as possible.
  EXPECT_GT(worst, 900ns);
}

TEST(ClockOffset, ForgetsWhatIsOldOrPushedOut) {
  ClockOffset clock;
  EXPECT_FALSE(clock.at(0s));
  ASSERT_TRUE(clock.add(exchange(0s, 1ms, 0s, 1ms, 1s)));
  ASSERT_TRUE(clock.at(30s + 2ms)) << "the sample came back at 2 ms";
  EXPECT_EQ(clock.at(30s + 2ms)->round_trip, 2ms);
  EXPECT_FALSE(clock.at(30s + 2ms + 1ns));
  for (int i = 0; i < 15; ++i) ASSERT_TRUE(clock.add(exchange(1s, 5ms, 0s, 5ms, 1s)));
  EXPECT_EQ(clock.at(2s)->round_trip, 2ms);
  ASSERT_TRUE(clock.add(exchange(1s, 5ms, 0s, 5ms, 1s)));
  EXPECT_EQ(clock.at(2s)->round_trip, 10ms);
}

TEST(ClockOffset, RefusesWhatNoClocksCanShow) {
  ClockOffset clock;
  EXPECT_FALSE(clock.add({1s, 5s, 4s, 2s}));  // the peer sent before it received
  EXPECT_FALSE(clock.add({1s, 5s, 7s, 2s}));  // the peer held it for longer than the round trip
  EXPECT_FALSE(clock.add({2s, 5s, 5s, 1s}));  // it came back before it was sent
  const Time most(std::numeric_limits<std::int64_t>::max()), least(std::numeric_limits<std::int64_t>::min());
  for (const Time peer : {most, least}) EXPECT_FALSE(clock.add({1s, peer, peer, 2s}));
  EXPECT_FALSE(clock.add({least, 0s, 0s, most}));
  EXPECT_FALSE(clock.at(2s));
}

}  // namespace
}  // namespace osteon
