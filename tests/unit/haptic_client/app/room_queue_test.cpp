// Tests that the queue to the replica's thread keeps the order, makes a fast sender wait, and lets it go at the end.
#include "haptic_client/app/room_queue.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/support/wait.hpp"

namespace osteon::haptic::test {
namespace {

using namespace std::chrono_literals;
using osteon::test::wait_until;

RoomMessage noted(std::uint64_t seq) { return EventNoted{RoomSeq{seq}}; }

std::uint64_t seq_of(const RoomMessage& message) { return std::get<EventNoted>(message).seq.value; }

TEST(RoomQueue, GivesEverythingInTheOrderReceived) {
  RoomQueue queue;
  for (std::uint64_t seq = 1; seq <= 3; ++seq) EXPECT_TRUE(queue.push(noted(seq)));
  queue.push_tool("drill-3.2");
  RoomQueue::Batch batch;
  queue.take(batch, 0ms);
  ASSERT_EQ(batch.messages.size(), 3u);
  for (std::uint64_t i = 0; i < 3; ++i) EXPECT_EQ(seq_of(batch.messages[i]), i + 1);
  EXPECT_EQ(batch.tools, std::vector<std::string>{"drill-3.2"});
}

TEST(RoomQueue, MakesASenderWaitWhileItIsFull) {
  RoomQueue queue;
  constexpr std::uint64_t kAll = RoomQueue::kMost + 10;
  std::atomic<std::uint64_t> pushed{0};
  std::thread sender([&] {
    for (std::uint64_t seq = 1; seq <= kAll; ++seq) {
      EXPECT_TRUE(queue.push(noted(seq)));
      pushed = seq;
    }
  });
  EXPECT_TRUE(wait_until([&] { return pushed == RoomQueue::kMost; }, 10s));
  std::this_thread::sleep_for(20ms);  // for a sender that would not wait
  EXPECT_EQ(pushed, RoomQueue::kMost);
  std::uint64_t taken = 0;
  while (taken < kAll) {
    RoomQueue::Batch batch;
    queue.take(batch, 10s);
    EXPECT_LE(batch.messages.size(), RoomQueue::kMost);
    for (const RoomMessage& message : batch.messages) EXPECT_EQ(seq_of(message), ++taken);
  }
  sender.join();
}

TEST(RoomQueue, LetsAWaitingSenderGoWhenItIsClosed) {
  RoomQueue queue;
  for (std::uint64_t seq = 1; seq <= RoomQueue::kMost; ++seq) (void)queue.push(noted(seq));
  std::thread sender([&] { EXPECT_FALSE(queue.push(noted(0))); });
  queue.close();
  sender.join();
  EXPECT_FALSE(queue.push(noted(0)));
}

}  // namespace
}  // namespace osteon::haptic::test
