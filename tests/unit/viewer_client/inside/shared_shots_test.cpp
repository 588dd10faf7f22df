// What the room is told of the own shots: the newest of each press, seldom enough, and the counts of all.
#include "viewer_client/inside/shared_shots.hpp"

#include <gtest/gtest.h>

namespace osteon {
namespace {

using namespace std::chrono_literals;

// Shoots as a console counts: one number after the other, 0.25 s each.
class SharedShotsTest : public testing::Test {
 protected:
  void shoot(bool first) {
    CArmShot shot;
    shot.number = ++totals_.shots;
    shot.exposure_s = 0.25;
    totals_.exposure_s += 0.25;
    shared_.add(shot, first, totals_);
  }

  SharedShots shared_;
  ShotTotals totals_;
  SharedShots::Clock::time_point now_{};
};

TEST_F(SharedShotsTest, ASingleShotIsToldAtOnceAndOnce) {
  EXPECT_FALSE(shared_.due(now_));
  shoot(true);
  const auto message = shared_.due(now_);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->run.first_number, 1u);
  EXPECT_EQ(message->run.last.number, 1u);
  EXPECT_EQ(message->run.shots(), 1u);
  EXPECT_EQ(message->run.exposure_s, 0.25);
  EXPECT_EQ(message->session, totals_);
  shared_.answered();
  EXPECT_FALSE(shared_.due(now_ + 1h));
}

TEST_F(SharedShotsTest, LivePicturesAreToldFourTimesASecondAndTheLastOneToo) {
  int told = 0;
  ShotRun newest;
  const auto tell = [&] {
    const auto message = shared_.due(now_);
    if (!message) return;
    ++told;
    EXPECT_GT(message->run.last.number, newest.last.number) << "never an older one";
    EXPECT_EQ(message->session, totals_);
    newest = message->run;
    shared_.answered();
  };
  // Ten seconds, with a picture each 50 ms.
  for (int i = 0; i < 200; ++i, now_ += 50ms) {
    shoot(i == 0);
    tell();
  }
  EXPECT_EQ(told, 40);
  now_ += 250ms;
  tell();
  EXPECT_EQ(newest.first_number, 1u);
  EXPECT_EQ(newest.last.number, 200u);
  EXPECT_EQ(newest.shots(), 200u);
  EXPECT_EQ(newest.exposure_s, 50.0);
}

TEST_F(SharedShotsTest, EachPressIsToldInTurnWhileTheRoomIsSlow) {
  shoot(true);
  ASSERT_TRUE(shared_.due(now_));
  for (const bool first : {true, false, false, true}) shoot(first);
  EXPECT_FALSE(shared_.due(now_ + 1h)) << "one message is on its way at most";
  shared_.answered();
  EXPECT_FALSE(shared_.due(now_ + 249ms));
  const auto pulses = shared_.due(now_ + 250ms);
  ASSERT_TRUE(pulses);
  EXPECT_EQ(pulses->run.first_number, 2u);
  EXPECT_EQ(pulses->run.last.number, 4u);
  EXPECT_EQ(pulses->run.exposure_s, 0.75);
  EXPECT_EQ(pulses->session.shots, 5u);
  shared_.answered();
  const auto single = shared_.due(now_ + 500ms);
  ASSERT_TRUE(single);
  EXPECT_EQ(single->run.first_number, 5u);
  EXPECT_EQ(single->run.shots(), 1u);
}

TEST_F(SharedShotsTest, WhatTheRoomWasNotThereForIsToldLater) {
  const auto lose = [&] {
    const auto message = shared_.due(now_ += 250ms);
    ASSERT_TRUE(message);
    shared_.answered();
    shared_.put_back(message->run);
  };
  shoot(true);
  lose();
  EXPECT_FALSE(shared_.idle());
  EXPECT_FALSE(shared_.due(now_ + 249ms));
  // The press goes on.
  shoot(false);
  lose();
  // The next press does not take its place.
  shoot(true);
  lose();
  const auto first = shared_.due(now_ += 250ms);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->run.first_number, 1u);
  EXPECT_EQ(first->run.last.number, 2u);
  EXPECT_EQ(first->run.exposure_s, 0.5);
  EXPECT_EQ(first->session.shots, 3u);
  shared_.answered();
  // While the next message is on its way, there is a newer state of its press.
  const auto second = shared_.due(now_ += 250ms);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->run.first_number, 3u);
  shoot(false);
  shared_.answered();
  shared_.put_back(second->run);
  const auto newer = shared_.due(now_ += 250ms);
  ASSERT_TRUE(newer);
  EXPECT_EQ(newer->run.first_number, 3u);
  EXPECT_EQ(newer->run.last.number, 4u);
  shared_.answered();
  EXPECT_TRUE(shared_.idle()) << "once is enough";
}

TEST_F(SharedShotsTest, WhatWaitsIsBoundedAndEndsWithTheRoom) {
  for (std::size_t i = 0; i < 10 * SharedShots::kMostWaiting; ++i) shoot(true);
  std::size_t told = 0;
  std::uint64_t newest = 0;
  for (now_ = {}; const auto message = shared_.due(now_); now_ += 250ms, shared_.answered()) {
    ++told;
    newest = message->run.last.number;
  }
  EXPECT_EQ(told, SharedShots::kMostWaiting);
  EXPECT_EQ(newest, 10 * SharedShots::kMostWaiting);
  shoot(true);
  shared_.begin();
  EXPECT_FALSE(shared_.due(now_ + 1h));
}

}  // namespace
}  // namespace osteon
