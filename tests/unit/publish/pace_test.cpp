// The rate at which a stream is sent states. The tick of a room waits for no stream.
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <random>

#include "osteon/v1/watch.pb.h"
#include "server/publish/state_publisher.hpp"
#include "tests/support/wait.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
constexpr std::chrono::nanoseconds kApart = 33'333'333ns;
constexpr Pace::Time kStart{1000s};

TEST(Pace, KeepsItsRateHoweverUnevenlyItIsAsked) {
  std::mt19937 random(5);
  Pace pace(kApart);
  int times = 0;
  Pace::Time last{};
  std::chrono::nanoseconds shortest = 1h;
  auto now = kStart;
  for (; now < kStart + 100s; now += 5ms + std::chrono::microseconds(random() % 7000)) {
    if (!pace.due(now)) continue;
    pace.done(now);
    if (times++) shortest = std::min(shortest, now - last);
    last = now;
  }
  EXPECT_NEAR(times, 3000, 2);
  EXPECT_GE(shortest, kApart - 12ms) << "the distance is shorter only by the lateness of one request";
}

TEST(Pace, AfterAPauseIsDueAtOnceAndOnlyOnce) {
  Pace pace(kApart);
  EXPECT_TRUE(pace.due(kStart));
  pace.done(kStart);
  EXPECT_FALSE(pace.due(kStart + kApart - 1ns));
  const auto later = kStart + 10s;
  EXPECT_TRUE(pace.due(later));
  pace.done(later);
  EXPECT_FALSE(pace.due(later + kApart - 1ns)) << "missed sends are not made up for";
}

TEST(Pace, ManyThatBeginTogetherTakeTurns) {
  std::vector<Pace> paces;
  for (std::size_t i = 0; i < 40; ++i) paces.emplace_back(kApart, i);
  std::vector<int> told;
  for (auto now = kStart; now < kStart + 1s; now += kApart / Pace::kTurns) {
    int due = 0;
    for (Pace& pace : paces)
      if (pace.due(now)) pace.done(now), ++due;
    told.push_back(due);
  }
  EXPECT_EQ(told.front(), 40) << "all are sent the first state at once";
  for (std::size_t i = 1; i < told.size(); ++i) EXPECT_LE(told[i], 10);
}

// A stream that receives slowly, as if many shared the server.
class SlowSubscriber final : public StateSubscriber {
 public:
  explicit SlowSubscriber(std::chrono::nanoseconds apart = {}) : apart_(apart) {}
  void enqueue(const ShownNow& now) override {
    std::unique_lock lock(mutex_);
    inside_ = true;
    opened_.wait(lock, [&] { return open_; });
    inside_ = false;
    ++messages_;
    newest_ = now.tools;
  }
  std::chrono::nanoseconds apart() const override { return apart_; }
  void end(const std::string&) override {}
  std::size_t waiting() const override { return 0; }
  void open(bool open) {
    const std::lock_guard lock(mutex_);
    open_ = open;
    opened_.notify_all();
  }
  bool inside() { return read(inside_); }
  int messages() { return read(messages_); }
  std::uint64_t room_seq() {
    const Bytes bytes = read(newest_);
    v1::WatchCuttingResponse message;
    EXPECT_TRUE(!bytes || message.ParseFromString(*bytes));
    return message.room_seq();
  }

 private:
  template <class T>
  T read(const T& value) {
    const std::lock_guard lock(mutex_);
    return value;
  }
  const std::chrono::nanoseconds apart_;
  std::mutex mutex_;
  std::condition_variable opened_;
  bool open_ = true, inside_ = false;
  int messages_ = 0;
  Bytes newest_;
};

CuttingState state(std::uint64_t seq) {
  CuttingState state;
  state.author = AuthorId{1};
  state.state_seq = seq;
  return state;
}

TEST(StatePublisher, ATickWaitsForNoStreamAndEveryStreamEndsWithTheNewest) {
  StatePublisher board;
  SlowSubscriber slow, prompt, seldom(20ms);
  for (SlowSubscriber* subscriber : {&slow, &prompt, &seldom}) board.watch(*subscriber);
  slow.open(false);
  board.update(state(1));
  board.publish(RoomSeq{1});
  ASSERT_TRUE(test::wait_until([&] { return slow.inside(); }, 20s));
  // The publisher's thread blocks in the slow subscriber. A room that waited for it would block here.
  for (std::uint64_t seq = 2; seq <= 500; ++seq) {
    board.update(state(seq));
    board.publish(RoomSeq{seq});
  }
  EXPECT_TRUE(slow.inside());
  slow.open(true);
  // Ticks without news send what is still due.
  ASSERT_TRUE(test::wait_until(
      [&] {
        board.publish(RoomSeq{500});
        return slow.room_seq() == 500 && prompt.room_seq() == 500 && seldom.room_seq() == 500;
      },
      20s));
  EXPECT_EQ(slow.messages(), 2) << "the state in which it blocked, and the newest";
  for (SlowSubscriber* subscriber : {&slow, &prompt, &seldom}) board.leave(*subscriber);
}

TEST(StatePublisher, ALateSubscriberIsSentTheNewestAtOnceAndStoppingSendsTheLast) {
  StatePublisher board;
  board.show({}, {BodyId{0}, BodyId{3}});
  SlowSubscriber early, late;
  board.watch(early);
  board.publish(RoomSeq{7});
  ASSERT_TRUE(test::wait_until([&] { return early.messages() == 1; }, 20s));
  board.watch(late);
  EXPECT_EQ(late.messages(), 1);
  EXPECT_EQ(late.room_seq(), 7u);
  board.publish(RoomSeq{8});  // Nothing has changed, so there is no message.
  board.update(state(1));
  board.publish(RoomSeq{9});
  board.stop();
  for (SlowSubscriber* subscriber : {&early, &late}) {
    EXPECT_EQ(subscriber->room_seq(), 9u);
    EXPECT_EQ(subscriber->messages(), 2);
  }
}

}  // namespace
}  // namespace osteon
