// How the field's stream begins in a room with a journal on a slow disk, and whether it begins at all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <utility>

#include "server/storage/room_store.hpp"
#include "tests/support/disk/memory_disk.hpp"
#include "tests/unit/viewer_client/followed_room.hpp"
#include "viewer_client/net/field_follower.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::FieldTap;
using test::FollowedRoom;
using testing::HasSubstr;

constexpr std::size_t kEnough = std::size_t{1} << 30;

class FieldBegins : public testing::Test {
 protected:
  void SetUp() override {
    RoomStore::Options options;
    options.name = "femur";
    options.journal.disk = &disk_;
    Result<PersistedRoom> kept = RoomStore::open("/rooms/femur", bone_, options);
    ASSERT_TRUE(kept) << kept.error().message;
    store_ = std::move(kept->store);
    room_.emplace(std::move(kept->room), store_.get());
  }

  const Case bone_ = test::test_block();
  test::MemoryDisk disk_{1};
  std::unique_ptr<RoomStore> store_;
  std::optional<FollowedRoom> room_;
};

TEST_F(FieldBegins, AFailedJournalEndsReadersAndCopiesNothingForNewOnes) {
  room_->cut(3);
  const auto open = room_->open();
  room_->tick();
  EXPECT_TRUE(open->given_leaves());
  disk_.fail_sync_at(1, EIO, test::MemoryDisk::Lasting::from_then_on);
  room_->cut(1);
  room_->tick();
  EXPECT_THAT(open->ended(), HasSubstr("the room takes no more cuts"));
  EXPECT_FALSE(open->may_return());
  const auto late = room_->open();
  room_->tick();
  EXPECT_EQ(late->ended(), open->ended());
  EXPECT_FALSE(late->may_return());
  EXPECT_FALSE(late->begun() || late->given_leaves()) << "nobody would be sent it";
}

TEST_F(FieldBegins, WhoIsSentAwayMayReturn) {
  const auto open = room_->open();
  room_->runtime().send_away("the server stops for a moment");
  EXPECT_TRUE(open->may_return());
  const auto late = room_->open();
  EXPECT_TRUE(late->may_return());
  EXPECT_FALSE(late->begun());
}

// What a reader is sent must be durable, and whole: neither what the leaves contain already nor what came while they
// were copied may be missing or counted twice.
TEST_F(FieldBegins, EventsAreDurableBetweenTheCopyAndItsSending) {
  room_->cut(3);
  room_->queue_cut();
  room_->tick(false);  // decided, in the leaves, and not durable
  const RoomSeq contained = room_->runtime().room_seq();
  room_->queue_cut();
  room_->queue_cut();  // decided after the copy, and before its leaves are given
  const auto tap = room_->open();
  room_->queue_cut();  // after them
  room_->tick(false);
  ASSERT_TRUE(tap->begun());
  EXPECT_FALSE(tap->given_leaves());
  EXPECT_TRUE(tap->read().empty()) << "it is not durable";
  room_->tick();
  EXPECT_TRUE(tap->given_leaves());
  room_->cut(2);
  FieldFollower viewer(bone_, kEnough);
  viewer.begin();
  int events = 0;
  for (const v1::WatchFieldResponse& message : tap->read()) {
    const Result<void> taken = viewer.take(message);
    ASSERT_TRUE(taken) << taken.error().message;
    events += message.has_committed() ? 1 : 0;
  }
  EXPECT_EQ(events, 5) << "three around the copy and two after it";
  const BoneStatus room = room_->status();
  EXPECT_EQ(room.room_seq.value, contained.value + 5);
  ASSERT_TRUE(viewer.follows());
  EXPECT_EQ(viewer.bone().room_seq(), room.room_seq);
  EXPECT_EQ(viewer.bone().hash(), room.field_hash);
}

// Whoever changes the room has its lock, and would wait for whoever reads it.
TEST_F(FieldBegins, WhoAsksInVainDoesNotWaitForTheRoom) {
  for (std::size_t i = 0; i < RoomRuntime::kMostFieldReaders; ++i)
    room_->open(room_->join(MemberKind::watcher, "", Role::observer));
  const auto reader = std::make_shared<FieldTap>(room_->viewer());
  const auto ask = [&] {
    std::future<Result<void>> answer;
    room_->happen([&](Room& room) {
      answer = std::async(std::launch::async, [&] { return room_->runtime().watch_field(reader); });
      EXPECT_EQ(answer.wait_for(10s), std::future_status::ready);
      return room.mark(room_->viewer(), "here");
    });
    return answer.get();
  };
  const Result<void> full = ask();
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().code, ErrorCode::exhausted);
  room_->runtime().end_streams("the room was closed");
  EXPECT_TRUE(ask());
  EXPECT_EQ(reader->ended(), "the room was closed");
}

// Copies for slow readers do not add up, and a single reader always gets its bone.
TEST(FieldCopies, AreNotMadeForOneReaderAfterAnotherWithoutEnd) {
  const Case bone = test::test_block();
  FollowedRoom room(Room(bone), nullptr, 1);
  room.cut(3);
  const auto slow = room.open();
  EXPECT_GT(slow->leaf_bytes(), 0u);
  const auto other = std::make_shared<FieldTap>(room.hand());
  const Result<void> refused = room.runtime().watch_field(other);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::exhausted);
  EXPECT_FALSE(other->begun());
  EXPECT_FALSE(slow->read().empty());
  EXPECT_EQ(slow->leaf_bytes(), 0u);
  EXPECT_TRUE(room.runtime().watch_field(other)) << "the other's leaves are on their way";
  room.runtime().leave(*other);
}

}  // namespace
}  // namespace osteon
