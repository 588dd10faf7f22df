// A client's replica beside the room: each holder's bone equals the room's once it has received everything.
#include <gtest/gtest.h>

#include <random>

#include "common/volume/replica.hpp"
#include "server/room/room.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/room/parts.hpp"

namespace osteon {
namespace {

using test::commit_cut;
using test::half;
using test::strokes;
using test::test_block;

void hear(Replica& replica, const RoomEvent& event) {
  if (event.bone) replica.change(event.room_seq, event.bodies, event.leaves);
  replica.lease(event.lease_epoch);
  replica.settle();
}

// An undo that arrives first drops the prediction. The replica equals the room once everything is received.
TEST(RoomReplica, DropsWhatWasPredictedOnFallenBone) {
  Room room(test_block());
  const AuthorId a = room.join(MemberKind::surgeon), b = room.join(MemberKind::surgeon);
  const auto cuts = strokes(a, 4, 40);
  Replica replica(room.bone(), BodyId{0});
  for (int i = 0; i < 2; ++i) replica.add_own(cuts[static_cast<std::size_t>(i)]);
  for (int i = 0; i < 2; ++i)
    replica.commit(commit_cut(room, cuts[static_cast<std::size_t>(i)]), cuts[static_cast<std::size_t>(i)], true);
  replica.add_own(cuts[2]);  // This cut is under way when the other author undoes.
  const auto undo = room.undo_last(b, 1, {});
  ASSERT_TRUE(undo);
  replica.add_own(cuts[3]);
  EXPECT_EQ(room.submit(cuts[2])->rejection, Rejection::lease);
  EXPECT_EQ(room.submit(cuts[3])->rejection, Rejection::lease);
  hear(replica, *undo);
  EXPECT_EQ(replica.unconfirmed(), 0u);
  EXPECT_FALSE(replica.reject(RoomSeq{6}, 3)) << "it was dropped already";
  EXPECT_FALSE(replica.reject(RoomSeq{7}, 4));
  replica.settle();
  EXPECT_EQ(replica.hash(), room.field_hash());
  EXPECT_EQ(replica.hash(), bone_after({cuts[0]}));
  EXPECT_EQ(replica.room_seq(), room.room_seq());
}

// Another author splits the bone while own cuts are pending. The pending cuts reach the new body as well.
TEST(RoomReplica, PredictsInPiecesThatItReceivesLate) {
  Room room(test_block());
  const AuthorId a = room.join(MemberKind::surgeon);
  const auto cuts = strokes(a, 12, 41);
  Replica replica(room.bone(), BodyId{0});
  for (const Cut& cut : cuts) replica.add_own(cut);
  const auto split = room.split(BodyId{0}, {half(room.bone(), false)}, room.bone_epoch());
  ASSERT_TRUE(split);
  hear(replica, *split);
  EXPECT_EQ(replica.bodies().size(), 2u);
  EXPECT_EQ(replica.unconfirmed(), cuts.size());
  const Digest predicted = replica.hash();
  for (const Cut& cut : cuts) replica.commit(commit_cut(room, cut), cut, true);
  replica.settle();
  EXPECT_EQ(replica.hash(), room.field_hash());
  EXPECT_EQ(predicted, room.field_hash()) << "the prediction was right";
}

// Any mixture of events by two authors. Replicas that joined at the start and replicas that joined later equal the
// room's bone.
TEST(RoomReplica, EveryHolderHasTheRoomsHashAfterAnyEvents) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    Room room(test_block());
    const AuthorId hands[] = {room.join(MemberKind::surgeon), room.join(MemberKind::surgeon)};
    std::vector<Cut> cuts[] = {strokes(hands[0], 40, seed), strokes(hands[1], 40, 100 + seed)};
    std::size_t next[] = {0, 0};
    std::vector<Replica> holders;
    holders.emplace_back(room.bone(), BodyId{0});
    bool upper = false;
    for (int i = 0; i < 36; ++i) {
      const std::size_t who = random() % 2;
      Result<RoomEvent> event = failure(ErrorCode::internal, "");
      switch (random() % 8) {
        case 0:
          event = room.undo_last(hands[who], 1 + random() % 3, {});
          break;
        case 1:
          event = room.redo_last(hands[who], 1);
          break;
        case 2:
          if (room.bodies().size() == 1)
            event = room.split(BodyId{0}, {half(room.bone(), upper = !upper)}, room.bone_epoch());
          break;
        case 3:
          if (room.bodies().size() > 1) event = room.remove_body(hands[who], room.bodies().back());
          break;
        default: {
          Cut& cut = cuts[who][next[who]++];
          cut.lease_epoch = room.lease_epoch(cut.author);
          const RoomSeq seq = commit_cut(room, cut);
          for (Replica& holder : holders) holder.commit(seq, cut, false);
        }
      }
      if (event)
        for (Replica& holder : holders) hear(holder, *event);
      if (i % 12 == 11) {
        Replica& late = holders.emplace_back(room.bone(), BodyId{0});
        for (const BodyId body : room.bodies())
          for (const FieldLeaf& leaf : room.find_field(body)->leaves()) late.restore(leaf);
        late.change(room.room_seq(), room.bodies(), {});
        late.joined(room.room_seq());
      }
    }
    for (const Replica& holder : holders) EXPECT_EQ(holder.hash(), room.field_hash());
    // Whether or not every undo is redone, the bone is what the remaining cuts leave where nothing was split.
    while (room.undo_last(hands[0], 50, {})) {
    }
    if (room.bodies() == std::vector<BodyId>{BodyId{0}} && room.field_hash() != Room(test_block()).field_hash())
      ADD_FAILURE() << "the bone after an undo of everything is not the imported bone";
  }
}

std::vector<FieldLeaf> leaves_of(const Room& room) {
  std::vector<FieldLeaf> leaves;
  for (const BodyId body : room.bodies())
    std::ranges::move(room.find_field(body)->leaves(), std::back_inserter(leaves));
  return leaves;
}

// A client that reconnects has the room's bone with its own undecided cuts on top, whatever it missed. Under the tool
// nothing changes unless the bone did.
TEST(RoomReplica, IsRenewedAfterTheConnectionWasDown) {
  for (unsigned seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    Room room(test_block());
    const AuthorId own = room.join(MemberKind::surgeon), other = room.join(MemberKind::surgeon);
    const auto cuts = strokes(own, 12, seed), others = strokes(other, 12, 50 + seed);
    Replica replica(room.bone(), BodyId{0});
    std::size_t next = 0, next_other = 0;
    for (int i = 0; i < 4; ++i) {
      replica.add_own(cuts[next]);
      replica.commit(commit_cut(room, cuts[next]), cuts[next], true);
      ++next;
    }
    // The connection is down. Own cuts go on, some of them reach the room, and others work.
    const std::size_t reached = random() % 5;
    for (std::size_t i = 0; i < 6; ++i) replica.add_own(cuts[next + i]);
    for (std::size_t i = 0; i < reached; ++i) commit_cut(room, cuts[next + i]);
    for (int i = 0; i < 3; ++i) commit_cut(room, others[next_other++]);
    const bool splits = random() % 2, undoes = random() % 2;
    if (splits) {
      ASSERT_TRUE(room.split(BodyId{0}, {half(room.bone(), true)}, room.bone_epoch()));
    }
    if (undoes) {
      ASSERT_TRUE(room.undo_last(other, 2, {}));
    }
    const std::vector<FieldLeaf> now = leaves_of(room);
    replica.renew(room.room_seq(), room.bodies(), now, room.decided(own));
    replica.lease(room.lease_epoch(own));
    // The decisions since then arrive in the same turn or in a later one.
    const bool same_turn = random() % 2;
    if (!same_turn) replica.settle();
    // An undo drops the undecided cuts. Without an undo they stay.
    const std::size_t pending = undoes ? 0 : 6 - reached;
    EXPECT_EQ(replica.unconfirmed(), pending);
    if (pending == 0 && !same_turn) {
      EXPECT_EQ(replica.hash(), room.field_hash());
    }
    for (std::size_t i = reached; !undoes && i < 6; ++i)
      replica.commit(commit_cut(room, cuts[next + i]), cuts[next + i], true);
    replica.settle();
    EXPECT_EQ(replica.hash(), room.field_hash());
    EXPECT_EQ(replica.room_seq(), room.room_seq());
    // Once more, with no events in between.
    (void)replica.take_changes();
    replica.renew(room.room_seq(), room.bodies(), leaves_of(room), room.decided(own));
    replica.settle();
    EXPECT_TRUE(replica.take_changes().empty());
    EXPECT_EQ(replica.hash(), room.field_hash());
  }
}

// As when a client gives up: its replica is then only what the room has decided.
TEST(RoomReplica, EqualsTheRoomOnceWhatIsUnacknowledgedIsDropped) {
  Room room(test_block());
  const AuthorId own = room.join(MemberKind::surgeon);
  const auto cuts = strokes(own, 12, 43);
  Replica replica(room.bone(), BodyId{0});
  for (const Cut& cut : cuts) replica.add_own(cut);
  for (std::size_t i = 0; i < 5; ++i) replica.commit(commit_cut(room, cuts[i]), cuts[i], true);
  replica.settle();
  ASSERT_NE(replica.hash(), room.field_hash());
  EXPECT_EQ(replica.drop_unconfirmed(), 7u);
  EXPECT_EQ(replica.unconfirmed(), 0u);
  EXPECT_EQ(replica.hash(), room.field_hash());
  EXPECT_EQ(replica.removed_mm3(), room.field().removed_mm3());
  EXPECT_EQ(replica.drop_unconfirmed(), 0u);
}

}  // namespace
}  // namespace osteon
