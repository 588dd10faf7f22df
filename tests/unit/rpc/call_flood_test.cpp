// How many calls may begin, against what the limit says.
#include "server/rpc/call_flood.hpp"

#include <gtest/gtest.h>

#include <string>

namespace osteon {
namespace {

using namespace std::chrono_literals;

constexpr FloodLimit kLimit{.at_once = 10.0, .per_second = 4.0};

// The calls that may begin now.
int through(CallFlood& flood, const std::string& whose, CallFlood::Time now) {
  int count = 0;
  while (flood.take(whose, now)) ++count;
  return count;
}

TEST(CallFlood, TakesTheReserveAndThenTheRate) {
  CallFlood flood(kLimit);
  CallFlood::Time now{};
  EXPECT_EQ(through(flood, "anna", now), 10);
  EXPECT_EQ(through(flood, "anna", now), 0);
  EXPECT_EQ(through(flood, "ben", now), 10) << "the person is another one";
  now += 1s;
  EXPECT_EQ(through(flood, "anna", now), 4);
  now += 500ms;
  EXPECT_EQ(through(flood, "anna", now), 2);
}

TEST(CallFlood, SavesNoMoreThanTheReserve) {
  CallFlood flood(kLimit);
  CallFlood::Time now{};
  EXPECT_EQ(through(flood, "anna", now), 10);
  now += 1h;
  EXPECT_EQ(through(flood, "anna", now), 10);
}

// Two threads may read the clock in one order and come here in the other.
TEST(CallFlood, AnOlderTimeGivesAndTakesNothing) {
  CallFlood flood(kLimit);
  const CallFlood::Time now = CallFlood::Time{} + 1h;
  EXPECT_EQ(through(flood, "anna", now), 10);
  EXPECT_EQ(through(flood, "anna", now - 10s), 0);
  EXPECT_EQ(through(flood, "anna", now), 0);
  EXPECT_EQ(through(flood, "anna", now + 1s), 4);
}

}  // namespace
}  // namespace osteon
