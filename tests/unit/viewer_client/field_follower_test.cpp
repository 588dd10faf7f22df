// A viewer's copy of the bone over good and bad connections. The room itself says what its bone is.
#include "viewer_client/net/field_follower.hpp"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <optional>
#include <set>

#include "common/wire/convert.hpp"
#include "osteon/v1/cutting.pb.h"
#include "tests/support/wait.hpp"
#include "tests/unit/viewer_client/followed_room.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::FieldMessages;
using test::FieldTap;
using test::FollowedRoom;
using testing::HasSubstr;
using testing::Not;

constexpr std::size_t kPlenty = std::size_t{256} << 20;

class Following : public testing::Test {
 protected:
  // Hands messages over until one is refused.
  Result<void> give(const FieldMessages& messages) {
    for (const v1::WatchFieldResponse& message : messages)
      if (Result<void> taken = follower_.take(message); !taken) return taken;
    return {};
  }
  // Begins a stream that works.
  std::shared_ptr<FieldTap> follow() {
    follower_.begin();
    std::shared_ptr<FieldTap> tap = room_.open();
    const Result<void> taken = give(tap->read());
    EXPECT_TRUE(taken) << taken.error().message;
    EXPECT_TRUE(follower_.follows());
    return tap;
  }
  void expect_the_rooms_bone() {
    const BoneStatus status = room_.status();
    EXPECT_EQ(follower_.bone().hash(), status.field_hash);
    EXPECT_EQ(follower_.bone().room_seq(), status.room_seq);
    EXPECT_EQ(follower_.bone().bodies().size(), status.bodies.size());
  }

  const Case bone_ = test::test_block();
  FollowedRoom room_{bone_};
  FieldFollower follower_{bone_, kPlenty};
};

TEST_F(Following, JoinsLateAndHasTheRoomsBone) {
  const Digest uncut = room_.status().field_hash;
  room_.cut(12);
  EXPECT_FALSE(follower_.whole());
  const auto tap = follow();
  expect_the_rooms_bone();
  EXPECT_NE(follower_.bone().hash(), uncut);
  room_.cut(12);
  ASSERT_TRUE(give(tap->read()));
  expect_the_rooms_bone();
  EXPECT_GT(follower_.bone().removed_mm3(), 10.0);
}

TEST_F(Following, IsAtAnEarlierEventWhileMessagesAreDelayed) {
  const auto tap = follow();
  std::map<RoomSeq, Digest> bones;
  for (int i = 0; i < 20; ++i) {
    room_.cut(1);
    bones[room_.status().room_seq] = room_.status().field_hash;
  }
  for (const v1::WatchFieldResponse& late : tap->read()) {
    ASSERT_TRUE(follower_.take(late));
    ASSERT_TRUE(bones.contains(follower_.bone().room_seq()));
    EXPECT_EQ(follower_.bone().hash(), bones.at(follower_.bone().room_seq()));
  }
  expect_the_rooms_bone();
}

TEST_F(Following, TakesEachMessageOnce) {
  const auto tap = follow();
  room_.cut(4);
  room_.happen([&](Room& room) { return room.undo_last(room_.viewer(), 2, room_.hand()); });
  const FieldMessages messages = tap->read();
  for (std::size_t i = 0; i < messages.size(); ++i) {
    ASSERT_TRUE(follower_.take(messages[i]));
    for (std::size_t again = 0; again <= i; ++again) ASSERT_TRUE(follower_.take(messages[again])) << i << " " << again;
  }
  expect_the_rooms_bone();
}

TEST_F(Following, AsksAgainAfterALostMessage) {
  const auto tap = follow();
  room_.cut(3);
  const BoneStatus third = room_.status();
  room_.cut(5);
  FieldMessages messages = tap->read();
  messages.erase(messages.begin() + 3);
  const Result<void> taken = give(messages);
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::unavailable);
  EXPECT_EQ(follower_.bone().hash(), third.field_hash) << "nothing after the gap is in the bone";
  follower_.begin();
  EXPECT_TRUE(follower_.whole()) << "pictures go on with what is there";
  EXPECT_EQ(follower_.bone().hash(), third.field_hash);
  (void)follow();
  expect_the_rooms_bone();
}

TEST_F(Following, AsksAgainAfterMessagesThatChangedPlaces) {
  const auto tap = follow();
  room_.cut(6);
  FieldMessages messages = tap->read();
  std::swap(messages[2], messages[3]);
  const Result<void> taken = give(messages);
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::unavailable);
  (void)follow();
  expect_the_rooms_bone();
}

// The room has undone cuts while the viewer was away: leaves that it holds exist no more.
TEST_F(Following, ForgetsWhatWasUndoneWhileItWasAway) {
  (void)follow();
  const Digest uncut = room_.status().field_hash;
  const auto tap = follow();
  room_.cut(6);
  ASSERT_TRUE(give(tap->read()));
  EXPECT_NE(follower_.bone().hash(), uncut);
  room_.happen([&](Room& room) { return room.undo_last(room_.viewer(), 6, room_.hand()); });
  (void)follow();
  expect_the_rooms_bone();
  EXPECT_EQ(follower_.bone().hash(), uncut);
}

TEST_F(Following, FollowsUndoAndRedo) {
  const auto tap = follow();
  room_.cut(6);
  const Digest cut = room_.status().field_hash;
  room_.happen([&](Room& room) { return room.undo_last(room_.viewer(), 4, room_.hand()); });
  ASSERT_TRUE(give(tap->read()));
  expect_the_rooms_bone();
  EXPECT_NE(follower_.bone().hash(), cut);
  room_.happen([&](Room& room) { return room.redo_last(room_.viewer(), 1); });
  room_.cut(2);
  ASSERT_TRUE(give(tap->read()));
  expect_the_rooms_bone();
}

TEST_F(Following, SeesAFrozenHandAsEventsThatLeaveTheBone) {
  const auto tap = follow();
  room_.cut(2);
  const Digest before = room_.status().field_hash;
  room_.happen([&](Room& room) {
    return room.supervise(room_.viewer(), room_.hand(), {.stopped = true, .words = "private words"});
  });
  room_.cut(3);
  const FieldMessages messages = tap->read();
  for (const v1::WatchFieldResponse& message : messages)
    EXPECT_THAT(message.SerializeAsString(), Not(HasSubstr("private words")));
  ASSERT_TRUE(give(messages));
  expect_the_rooms_bone();
  EXPECT_EQ(follower_.bone().hash(), before);
  room_.happen([&](Room& room) { return room.supervise(room_.viewer(), room_.hand(), {}); });
  room_.cut(3);
  ASSERT_TRUE(give(tap->read()));
  expect_the_rooms_bone();
  EXPECT_NE(follower_.bone().hash(), before);
}

TEST_F(Following, SaysWhichLeavesHaveChanged) {
  const auto tap = follow();
  EXPECT_TRUE(follower_.take_changes().all) << "at first, everything is new";
  const auto values = [&] {
    std::map<std::pair<int, Coord>, std::vector<std::int16_t>> all;
    for (const FieldLeaf& leaf : follower_.bone().bodies()[0]->leaves()) all[{leaf.level, leaf.origin}] = leaf.values;
    return all;
  };
  const auto check = [&] {
    const auto before = values();
    ASSERT_TRUE(give(tap->read()));
    auto after = values();
    for (const auto& [place, leaf] : before) after.try_emplace(place);
    std::set<std::pair<int, Coord>> listed;
    const FieldChanges changes = follower_.take_changes();
    EXPECT_FALSE(changes.all);
    for (const ChangedLeaves& change : changes.leaves)
      for (const Coord& origin : change.origins) listed.insert({change.level, origin});
    std::size_t differ = 0;
    for (const auto& [place, leaf] : after) {
      const auto old = before.find(place);
      if (old != before.end() && old->second == leaf) continue;
      ++differ;
      EXPECT_TRUE(listed.contains(place));
    }
    EXPECT_GT(differ, 0u);
  };
  room_.cut(3);
  check();
  room_.happen([&](Room& room) { return room.undo_last(room_.viewer(), 2, room_.hand()); });
  check();
  EXPECT_TRUE(follower_.take_changes().leaves.empty());
}

TEST_F(Following, GivesUpWhereTheBoneNeedsMoreThanItHas) {
  room_.cut(12);
  FieldFollower small(bone_, 16 * 1024);
  std::optional<Error> refused;
  for (const v1::WatchFieldResponse& message : room_.open()->read())
    if (const Result<void> taken = small.take(message); !taken) {
      refused = taken.error();
      break;
    }
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, ErrorCode::exhausted);
  EXPECT_THAT(refused->message, HasSubstr("undo cuts"));
  EXPECT_FALSE(small.whole());
  // Cuts count as much as leaves do.
  FollowedRoom other(bone_);
  FieldFollower growing(bone_, 64 * 1024);
  const auto tap = other.open();
  refused.reset();
  for (int i = 0; i < 200 && !refused; ++i) {
    for (const v1::WatchFieldResponse& message : tap->read())
      if (const Result<void> taken = growing.take(message); !taken) refused = taken.error();
    other.cut(1);
  }
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, ErrorCode::exhausted);
}

TEST_F(Following, RefusesWhatNoServerSends) {
  const auto tap = follow();
  room_.cut(1);
  const FieldMessages messages = tap->read();
  const Digest before = follower_.bone().hash();
  v1::WatchFieldResponse wrong = messages.at(0);
  wrong.mutable_committed()->mutable_cut()->set_tool_hash(std::string(32, '\1'));
  EXPECT_THAT(follower_.take(wrong).error().message, HasSubstr("a tool that was not sent"));
  EXPECT_EQ(follower_.bone().hash(), before);

  // Cuts that would keep the viewer computing for ever.
  for (const auto& [x, sentence] : {std::pair(1 << 30, "far from the bone"), std::pair(300 << 10, "limits.swept_mm")}) {
    (void)follow();
    v1::WatchFieldResponse cut = messages.at(0);
    cut.mutable_committed()->set_room_seq(room_.status().room_seq.value + 1);
    v1::QuantisedPose& end = *cut.mutable_committed()->mutable_cut()->add_path();
    end = cut.committed().cut().path(0);
    end.set_position(0, x);
    EXPECT_THAT(follower_.take(cut).error().message, HasSubstr(sentence));
  }
  EXPECT_EQ(follower_.bone().hash(), room_.status().field_hash);

  follower_.begin();
  EXPECT_THAT(follower_.take(messages.at(0)).error().message, HasSubstr("before the leaves were complete"));
  v1::WatchFieldResponse nobody;
  nobody.mutable_complete()->set_room_seq(9);
  EXPECT_THAT(follower_.take(nobody).error().message, HasSubstr("bodies is empty"));
  v1::WatchFieldResponse leaf;
  *leaf.mutable_leaf() = wire::to_wire(FieldLeaf{BodyId{7}, 0, {}, {5}});
  nobody.mutable_complete()->add_bodies(0);
  follower_.begin();
  ASSERT_TRUE(follower_.take(leaf));
  EXPECT_THAT(follower_.take(nobody).error().message, HasSubstr("not among bodies"));
  leaf.mutable_leaf()->mutable_origin()->set_x(1 << 30);
  follower_.begin();
  EXPECT_THAT(follower_.take(leaf).error().message, HasSubstr("far from the bone"));
  EXPECT_EQ(follower_.bone().hash(), room_.status().field_hash) << "what was refused changed nothing";

  // A change in two parts, the second of which is missing.
  (void)follow();
  const Digest now = follower_.bone().hash();
  v1::WatchFieldResponse part;
  part.set_index(1);
  part.mutable_change()->set_room_seq(room_.status().room_seq.value + 1);
  part.mutable_change()->add_bodies(0);
  *part.mutable_change()->add_leaves() = wire::to_wire(FieldLeaf{BodyId{0}, 0, {}, {5}});
  ASSERT_TRUE(follower_.take(part));
  EXPECT_EQ(follower_.bone().hash(), now) << "half a change is no bone";
  v1::WatchFieldResponse next = messages.at(0);
  next.set_index(2);
  EXPECT_THAT(follower_.take(next).error().message, HasSubstr("the last part of a change is missing"));
}

// With the runtime's own threads, which look for pieces.
TEST(FollowingPieces, HoldsASawnPieceAsABody) {
  const Case bone = test::plain_block(14.0, 6.0, 0.5, 0.5);
  const auto tap = std::make_shared<FieldTap>(AuthorId{2});
  RoomRuntime runtime(Room(bone), {.tick = 1ms, .mesh = 20ms, .pieces = 1ms}, nullptr);
  const AuthorId hand = runtime.join(MemberKind::surgeon).value();
  ASSERT_EQ(runtime.join(MemberKind::watcher).value(), tap->author());
  ASSERT_TRUE(runtime.watch_field(tap));
  const auto sender = std::make_shared<test::FakeSession>(hand);
  std::uint64_t sent = 0;
  for (double z = 1.0; z > -8.0; z -= 1.5) {
    Cut cut = test::straight_cut(test::tool_named("burr-round-5"), {0, -9, z}, {0, 9, z}, {0, 0, -1}, ++sent);
    cut.author = hand;
    cut.lease_epoch = runtime.lease_epoch(hand);
    runtime.queue_cut(sender, cut, RoomRuntime::Clock::now());
  }
  ASSERT_TRUE(test::wait_until([&] { return runtime.bone_status().bodies.size() == 2; }, 30s));
  runtime.find_pieces();
  FieldFollower follower(bone, kPlenty);
  const auto is_the_rooms = [&] {
    for (const v1::WatchFieldResponse& message : tap->read()) {
      const Result<void> taken = follower.take(message);
      EXPECT_TRUE(taken) << taken.error().message;
    }
    const BoneStatus status = runtime.bone_status();
    return follower.whole() && follower.bone().room_seq() == status.room_seq &&
           follower.bone().hash() == status.field_hash && follower.bone().bodies().size() == status.bodies.size();
  };
  EXPECT_TRUE(test::wait_until(is_the_rooms, 30s));
  EXPECT_EQ(follower.bone().bodies().size(), 2u);
  // A piece lacks what was cut and what is in the others, so the sum is what the slot took: not half a block.
  EXPECT_LT(follower.bone().removed_mm3(), 0.6 * bone.volume_mm3());
  // A point of each piece is bone in one body alone.
  for (const double x : {-5.0, 5.0}) {
    const auto bodies = follower.bone().bodies();
    const auto solid = [&](const CutField* body) { return body->solid_mm({x, 0, -3}) < 0; };
    EXPECT_EQ(std::ranges::count_if(bodies, solid), 1) << x;
  }

  // The piece is taken away, and comes back.
  const auto ask = [&](std::function<Result<RoomEvent>(Room&)> change) {
    std::atomic<bool> done{false};
    runtime.queue_event(std::move(change), [&](const Result<RoomEvent>& event) {
      EXPECT_TRUE(event) << event.error().message;
      done = true;
    });
    ASSERT_TRUE(test::wait_until([&] { return done.load(); }, 30s));
  };
  ask([&](Room& room) { return room.remove_body(tap->author(), BodyId{1}); });
  EXPECT_TRUE(test::wait_until(is_the_rooms, 30s));
  EXPECT_EQ(follower.bone().bodies().size(), 1u);
  ask([&](Room& room) { return room.undo_last(tap->author(), 1, {}); });
  EXPECT_TRUE(test::wait_until(is_the_rooms, 30s));
  EXPECT_EQ(follower.bone().bodies().size(), 2u);
  runtime.stop();
}

TEST(FieldProtocol, IsAPartOfTheSessions) {
  const google::protobuf::Descriptor* session = v1::SessionResponse::descriptor();
  const google::protobuf::Descriptor* field = v1::WatchFieldResponse::descriptor();
  ASSERT_GE(field->field_count(), 7);
  for (int i = 0; i < field->field_count(); ++i) {
    const google::protobuf::FieldDescriptor* one = field->field(i);
    const google::protobuf::FieldDescriptor* other = session->FindFieldByNumber(one->number());
    ASSERT_NE(other, nullptr) << one->name();
    EXPECT_EQ(other->name(), one->name());
    EXPECT_EQ(other->type(), one->type());
    EXPECT_EQ(other->message_type(), one->message_type());
  }
  for (int i = 0; i < session->field_count(); ++i) {
    const int number = session->field(i)->number();
    EXPECT_TRUE(field->FindFieldByNumber(number) || field->IsReservedNumber(number)) << session->field(i)->name();
  }
}

}  // namespace
}  // namespace osteon
