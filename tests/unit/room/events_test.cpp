// The room's events other than cuts. Each bone is compared with that of a new room that only ever had the remaining
// cuts.
#include <gtest/gtest.h>

#include <functional>

#include "common/field/kernel.hpp"
#include "server/room/room.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/room/parts.hpp"

namespace osteon {
namespace {

using test::commit_cut;
using test::half;
using test::part;
using test::strokes;
using test::test_block;
using test::tool_named;

// The bone of a room after only these cuts.
Digest bone_after(const std::vector<Cut>& cuts) {
  CutField field(test_block(), BodyId{0});
  for (const Cut& cut : cuts) field.apply(cut);
  return field.hash();
}

TEST(RoomUndo, LeavesTheBoneOfTheOtherCuts) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const auto cuts = strokes(surgeon, 5, 31);
  std::vector<RoomSeq> seqs;
  for (const Cut& cut : cuts) seqs.push_back(commit_cut(room, cut));
  const Digest all = room.field_hash();
  EXPECT_EQ(all, bone_after(cuts));

  const RoomSeq second[] = {seqs[1]};
  const auto undone = room.undo(surgeon, second);
  ASSERT_TRUE(undone) << undone.error().message;
  EXPECT_EQ(undone->room_seq.value, 7u) << "a surgeon has joined and made five cuts";
  EXPECT_EQ(undone->seqs, std::vector<RoomSeq>{seqs[1]});
  EXPECT_EQ(room.field_hash(), bone_after({cuts[0], cuts[2], cuts[3], cuts[4]}));
  EXPECT_FALSE(room.undo(surgeon, second)) << "it was undone already";
  ASSERT_TRUE(room.undo_last(surgeon, 2, {}));
  EXPECT_EQ(room.field_hash(), bone_after({cuts[0], cuts[2]}));

  ASSERT_TRUE(room.redo_last(surgeon, 1));
  EXPECT_EQ(room.field_hash(), bone_after({cuts[0], cuts[2], cuts[3], cuts[4]}));
  ASSERT_TRUE(room.redo_last(surgeon, 1));
  EXPECT_EQ(room.field_hash(), all);
  EXPECT_FALSE(room.redo_last(surgeon, 1)) << "there is nothing left to redo";
  ASSERT_TRUE(room.undo_last(surgeon, 99, {}));
  EXPECT_EQ(room.field_hash(), Room(test_block()).field_hash());
  EXPECT_FALSE(room.undo_last(surgeon, 1, {}));
}

TEST(RoomUndo, CountsTheEventsOfOneAuthorOrOfAll) {
  Room room(test_block());
  const AuthorId a = room.join(MemberKind::surgeon), b = room.join(MemberKind::surgeon),
                 watcher = room.join(MemberKind::watcher);
  const auto of_a = strokes(a, 2, 32), of_b = strokes(b, 2, 33);
  for (int i = 0; i < 2; ++i) {
    commit_cut(room, of_a[static_cast<std::size_t>(i)]);
    commit_cut(room, of_b[static_cast<std::size_t>(i)]);
  }
  ASSERT_TRUE(room.undo_last(watcher, 1, a));
  EXPECT_EQ(room.field_hash(), bone_after({of_a[0], of_b[0], of_b[1]}));
  ASSERT_TRUE(room.undo_last(watcher, 1, {}));
  EXPECT_EQ(room.field_hash(), bone_after({of_a[0], of_b[0]}));
}

TEST(RoomUndo, EndsTheLeasesUnderWhichOthersCut) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  auto cuts = strokes(surgeon, 3, 34);
  commit_cut(room, cuts[0]);
  const std::uint64_t before = room.lease_epoch(surgeon);
  ASSERT_TRUE(room.undo_last(surgeon, 1, {}));
  EXPECT_GT(room.lease_epoch(surgeon), before);
  EXPECT_EQ(room.submit(cuts[1])->rejection, Rejection::lease);
  cuts[2].lease_epoch = room.lease_epoch(surgeon);
  commit_cut(room, cuts[2]);
}

// A redo changes bone under everyone, as the undo did. So no cut of an earlier epoch is taken after it.
TEST(RoomUndo, ARedoEndsTheLeasesToo) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon), partner = room.join(MemberKind::surgeon);
  commit_cut(room, strokes(surgeon, 1, 34)[0]);
  ASSERT_TRUE(room.undo_last(surgeon, 1, {}));
  const std::uint64_t of_surgeon = room.lease_epoch(surgeon), of_partner = room.lease_epoch(partner);
  ASSERT_TRUE(room.redo_last(surgeon, 1));
  EXPECT_GT(room.lease_epoch(surgeon), of_surgeon);
  EXPECT_GT(room.lease_epoch(partner), of_partner);
  auto cuts = strokes(partner, 2, 35);
  cuts[0].lease_epoch = of_partner;
  EXPECT_EQ(room.submit(cuts[0])->rejection, Rejection::lease);
  cuts[1].lease_epoch = room.lease_epoch(partner);
  commit_cut(room, cuts[1]);
}

TEST(RoomUndo, RefusesWhatCannotBeUndoneWithoutASequenceNumber) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const RoomSeq cut = commit_cut(room, strokes(surgeon, 1, 35)[0]);
  ASSERT_TRUE(room.undo_last(surgeon, 1, {}));
  const RoomSeq undo = room.room_seq(), unknown{77};
  for (const RoomSeq seq : {cut, undo, unknown}) {
    const RoomSeq seqs[] = {seq};
    EXPECT_FALSE(room.undo(surgeon, seqs)) << seq.value;
  }
  EXPECT_FALSE(room.undo(surgeon, {}));
  EXPECT_FALSE(room.undo_last(surgeon, 0, {}));
  EXPECT_FALSE(room.undo_last(AuthorId{9}, 1, {})) << "author 9 has not joined";
  EXPECT_FALSE(room.redo_last(AuthorId{9}, 1));
  EXPECT_EQ(room.room_seq(), undo);
}

// Compares two ways to the surface: remaking the blocks that each event makes stale, and making all at the end.
TEST(RoomUndo, NamesEveryBlockThatItMakesStale) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  BlockStore live;
  std::set<BlockKey> keys;
  const auto refresh = [&](const std::vector<BlockKey>& stale) {
    for (const BlockKey& key : stale) {
      live.put(key, room.find_field(key.body) ? make_block(room.gather_block(key)) : BlockPayload{});
      keys.insert(key);
    }
  };
  refresh(room.bone_blocks());
  for (const Cut& cut : strokes(surgeon, 8, 36)) {
    commit_cut(room, cut);
    refresh(room.take_stale_blocks());
  }
  ASSERT_TRUE(room.undo_last(surgeon, 3, {}));
  refresh(room.take_stale_blocks());
  ASSERT_TRUE(room.split(BodyId{0}, {half(room.bone(), true)}, room.bone_epoch()));
  refresh(room.take_stale_blocks());
  int of_piece = 0;
  for (const BlockKey& key : keys) {
    const BlockPayload anew = make_block(room.gather_block(key));
    const auto kept = live.blocks().find(key);
    EXPECT_EQ(anew, kept == live.blocks().end() ? BlockPayload{} : kept->second.payload)
        << key.body.value << ": " << key.index.x;
    of_piece += key.body == BodyId{1} && !anew.bytes.empty();
  }
  EXPECT_GT(of_piece, 0) << "the piece is drawn";
}

TEST(RoomSplit, MakesABodyOfThePieceAndCutsReachBoth) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const auto cuts = strokes(surgeon, 4, 37);
  const RoomSeq saw = commit_cut(room, cuts[0]);
  commit_cut(room, cuts[1]);
  const double before_mm3 = room.field().removed_mm3();
  const auto split = room.split(BodyId{0}, {half(room.bone(), true)}, room.bone_epoch());
  ASSERT_TRUE(split) << split.error().message;
  EXPECT_EQ(split->bodies, (std::vector<BodyId>{BodyId{0}, BodyId{1}}));
  ASSERT_NE(room.find_field(BodyId{1}), nullptr);

  // Each point of the bone is in one of the two bodies.
  const Vec3 up{6, 0, -6}, down{-6, 0, -6};
  EXPECT_GT(room.field().solid_mm(up), 0.0);
  EXPECT_LT(room.field().solid_mm(down), 0.0);
  EXPECT_LT(room.find_field(BodyId{1})->solid_mm(up), 0.0);
  EXPECT_GT(room.find_field(BodyId{1})->solid_mm(down), 0.0);
  const double parted_mm3 =
      room.field().removed_mm3() + room.find_field(BodyId{1})->removed_mm3() - room.bone().volume_mm3();
  EXPECT_NEAR(parted_mm3, before_mm3, 0.02 * room.bone().volume_mm3()) << "the split loses no bone";

  // A cut across the plane of the split takes bone of both bodies.
  Cut across = test::straight_cut(tool_named("burr-round-5"), {-4, 0, -1}, {4, 0, -1}, {0, 0, -1}, 3);
  across.author = surgeon;
  commit_cut(room, across);
  EXPECT_GT(room.find_field(BodyId{1})->solid_mm({3, 0, -0.5}), 0.0);
  EXPECT_GT(room.field().solid_mm({-3, 0, -0.5}), 0.0);

  // The undone cut is older than the split, so the split is undone too. The cuts after it stay in the bone.
  const RoomSeq oldest[] = {saw};
  const auto undone = room.undo(surgeon, oldest);
  ASSERT_TRUE(undone) << undone.error().message;
  EXPECT_EQ(undone->seqs, (std::vector<RoomSeq>{saw, split->room_seq}));
  EXPECT_EQ(room.bodies(), std::vector<BodyId>{BodyId{0}});
  EXPECT_EQ(room.field_hash(), bone_after({cuts[1], across}));

  // The redo brings back both.
  ASSERT_TRUE(room.redo_last(surgeon, 1));
  EXPECT_EQ(room.bodies().size(), 2u);
  CutField whole(room.bone(), BodyId{0}), piece(room.bone(), BodyId{1});
  for (CutField* field : {&whole, &piece})
    for (const Cut& cut : {cuts[0], cuts[1], across}) field->apply(cut);
  for (const FieldLeaf& leaf : half(room.bone(), true).taken) whole.merge(leaf);
  for (const FieldLeaf& leaf : half(room.bone(), true).left) piece.merge(leaf);
  EXPECT_EQ(room.field().hash(), whole.hash());
  EXPECT_EQ(room.find_field(BodyId{1})->hash(), piece.hash());
}

// A busy server looks for pieces after many cuts at once. The look must not grow with their number.
TEST(RoomSplit, ReportsALeafOnceHoweverManyCutsReachIt) {
  Room once(test_block()), often(test_block());
  const AuthorId surgeon = once.join(MemberKind::surgeon);
  often.join(MemberKind::surgeon);
  std::vector<Cut> cuts = strokes(surgeon, 1, 41);
  commit_cut(once, cuts[0]);
  for (std::uint64_t i = 0; i < 20; ++i) {
    Cut again = cuts[0];
    again.author_seq += i;
    commit_cut(often, again);
  }
  const std::vector<BodyLeaves> of_one = once.take_changes(), of_many = often.take_changes();
  ASSERT_FALSE(of_one.empty());
  ASSERT_EQ(of_many.size(), of_one.size());
  for (std::size_t i = 0; i < of_one.size(); ++i) {
    EXPECT_EQ(of_many[i].body, of_one[i].body);
    EXPECT_EQ(of_many[i].level, of_one[i].level);
    EXPECT_TRUE(std::ranges::equal(of_many[i].origins, of_one[i].origins));
  }
  EXPECT_TRUE(often.take_changes().empty());
}

// A body made in advance, from a copy that lacks the last cuts, equals the one that the room would have made.
TEST(RoomSplit, TakesAPieceThatWasMadeBeforehand) {
  Room slow(test_block()), fast(test_block());
  const AuthorId surgeon = slow.join(MemberKind::surgeon);
  fast.join(MemberKind::surgeon);
  const auto cuts = strokes(surgeon, 8, 41);
  for (std::size_t i = 0; i < 4; ++i) {
    commit_cut(slow, cuts[i]);
    commit_cut(fast, cuts[i]);
  }
  Separation found{BodyId{0}, {half(fast.bone(), true)}, fast.bone_epoch()};
  found.fields.emplace_back(fast.bone(), fast.next_body(), fast.tools());
  (void)fast.take_changes();
  for (FieldLeaf leaf : fast.field().leaves()) found.fields[0].restore(leaf);
  for (const FieldLeaf& leaf : found.fragments[0].left) found.fields[0].merge(leaf);
  for (std::size_t i = 4; i < 8; ++i) {
    commit_cut(slow, cuts[i]);
    commit_cut(fast, cuts[i]);
  }
  const auto split = fast.split(std::move(found));
  ASSERT_TRUE(split) << split.error().message;
  ASSERT_TRUE(slow.split(BodyId{0}, {half(slow.bone(), true)}, slow.bone_epoch()));
  EXPECT_EQ(fast.find_field(BodyId{1})->hash(), slow.find_field(BodyId{1})->hash());
  EXPECT_EQ(fast.field_hash(), slow.field_hash());
  // Both bodies have histories of their own.
  for (Room* room : {&slow, &fast}) {
    const RoomSeq second[] = {RoomSeq{2}, RoomSeq{7}};
    ASSERT_TRUE(room->undo(surgeon, second));
    ASSERT_TRUE(room->redo_last(surgeon, 1));
    ASSERT_TRUE(room->undo_last(surgeon, 2, {}));
  }
  EXPECT_EQ(fast.field_hash(), slow.field_hash());
}

TEST(RoomSplit, DebrisVanishesInTheSameEvent) {
  Room room(test_block());
  const auto split = room.split(BodyId{0}, {half(room.bone(), true, 0.5)}, room.bone_epoch());
  ASSERT_TRUE(split);
  EXPECT_EQ(room.bodies(), std::vector<BodyId>{BodyId{0}});
  EXPECT_GT(room.field().solid_mm({6, 0, -6}), 0.0);
  const RoomSeq seqs[] = {split->room_seq};
  ASSERT_TRUE(room.undo(room.join(MemberKind::watcher), seqs));
  EXPECT_LT(room.field().solid_mm({6, 0, -6}), 0.0);
}

TEST(RoomSplit, IsRefusedWhereBoneHasComeBackMeanwhile) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  commit_cut(room, strokes(surgeon, 1, 38)[0]);
  const std::uint64_t seen = room.bone_epoch();
  ASSERT_TRUE(room.undo_last(surgeon, 1, {}));
  EXPECT_FALSE(room.split(BodyId{0}, {half(room.bone(), true)}, seen));
  EXPECT_FALSE(room.split(BodyId{5}, {half(room.bone(), true)}, room.bone_epoch()));
  EXPECT_FALSE(room.split(BodyId{0}, {}, room.bone_epoch()));
}

TEST(RoomSplit, APieceIsTakenAwayAndComesBack) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  EXPECT_FALSE(room.remove_body(surgeon, BodyId{0})) << "the last body cannot be removed";
  ASSERT_TRUE(room.split(BodyId{0}, {half(room.bone(), true)}, room.bone_epoch()));
  const Digest parted = room.field_hash();
  const auto removed = room.remove_body(surgeon, BodyId{1});
  ASSERT_TRUE(removed) << removed.error().message;
  EXPECT_EQ(removed->bodies, std::vector<BodyId>{BodyId{0}});
  EXPECT_FALSE(room.remove_body(surgeon, BodyId{1}));
  EXPECT_EQ(room.field_hash(), room.field().hash());
  Cut cut = strokes(surgeon, 1, 39)[0];
  cut.body = BodyId{1};
  EXPECT_EQ(room.submit(cut)->rejection, Rejection::body);
  ASSERT_TRUE(room.undo_last(surgeon, 1, {}));
  EXPECT_EQ(room.field_hash(), parted);
}

TEST(RoomSplit, OfTwoPiecesOfABodyTheLaterFallsWithTheEarlier) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const auto cuts = strokes(surgeon, 2, 38);
  for (const Cut& cut : cuts) commit_cut(room, cut);
  const auto first = room.split(BodyId{0}, {part(room.bone(), [](int x) { return x >= 6; })}, room.bone_epoch());
  const auto second = room.split(BodyId{0}, {part(room.bone(), [](int x) { return x < -6; })}, room.bone_epoch());
  ASSERT_TRUE(first && second);
  ASSERT_EQ(room.bodies().size(), 3u);
  const Digest parted = room.field_hash();
  double apart_mm3 = -2.0 * room.bone().volume_mm3();
  for (const BodyId body : room.bodies()) apart_mm3 += room.find_field(body)->removed_mm3();

  // Otherwise the second body would also contain the bone of the first.
  const RoomSeq named[] = {first->room_seq};
  const auto undone = room.undo(surgeon, named);
  ASSERT_TRUE(undone) << undone.error().message;
  EXPECT_EQ(undone->seqs, (std::vector<RoomSeq>{first->room_seq, second->room_seq}));
  EXPECT_EQ(room.bodies(), std::vector<BodyId>{BodyId{0}});
  EXPECT_EQ(room.field_hash(), bone_after(cuts));
  EXPECT_NEAR(room.field().removed_mm3(), apart_mm3, 0.03 * room.bone().volume_mm3());

  ASSERT_TRUE(room.redo_last(surgeon, 1));
  EXPECT_EQ(room.field_hash(), parted);
  // An undo of the later split leaves the earlier one.
  const RoomSeq later[] = {second->room_seq};
  const auto one = room.undo(surgeon, later);
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(one->seqs, std::vector<RoomSeq>{second->room_seq});
  EXPECT_EQ(room.bodies().size(), 2u);
}

// Only a later split that stands keeps an earlier one of the same body undone. One that was undone itself does not:
// both come back, when both undos are taken back together.
TEST(RoomSplit, AnUndoneLaterSplitKeepsNoEarlierOneUndone) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const auto undo = [&](RoomSeq seq) {
    const RoomSeq seqs[] = {seq};
    return room.undo(surgeon, seqs).has_value();
  };
  const auto first = room.split(BodyId{0}, {part(room.bone(), [](int x) { return x >= 6; })}, room.bone_epoch());
  ASSERT_TRUE(first && undo(first->room_seq));
  const auto second = room.split(BodyId{0}, {part(room.bone(), [](int x) { return x < -6; })}, room.bone_epoch());
  ASSERT_TRUE(second && undo(second->room_seq));
  ASSERT_EQ(room.bodies().size(), 1u);

  const auto redone = room.redo_last(surgeon, 2);
  ASSERT_TRUE(redone) << redone.error().message;
  EXPECT_EQ(redone->seqs, (std::vector<RoomSeq>{first->room_seq, second->room_seq}));
  EXPECT_EQ(room.bodies().size(), 3u);
}

TEST(RoomSplit, UndoneItBringsBackTheBodyThatWasTakenAwayFromItsPiece) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const Digest whole = room.field_hash();
  const auto split = room.split(BodyId{0}, {half(room.bone(), true)}, room.bone_epoch());
  ASSERT_TRUE(split);
  const auto away = room.remove_body(surgeon, BodyId{0});
  ASSERT_TRUE(away) << away.error().message;
  const RoomSeq parting[] = {split->room_seq};
  const auto undone = room.undo(surgeon, parting);
  ASSERT_TRUE(undone) << undone.error().message;
  EXPECT_EQ(undone->seqs, (std::vector<RoomSeq>{split->room_seq, away->room_seq}));
  EXPECT_EQ(room.bodies(), std::vector<BodyId>{BodyId{0}});
  EXPECT_EQ(room.field_hash(), whole);
  ASSERT_TRUE(room.redo_last(surgeon, 1));
  EXPECT_EQ(room.bodies(), std::vector<BodyId>{BodyId{1}});
}

TEST(RoomSplit, ABodyThatIsAwayMissesNoCut) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const auto cuts = strokes(surgeon, 2, 39);
  for (const Cut& cut : cuts) commit_cut(room, cut);
  const auto split = room.split(BodyId{0}, {half(room.bone(), true)}, room.bone_epoch());
  ASSERT_TRUE(split);
  const auto away = room.remove_body(surgeon, BodyId{0});
  ASSERT_TRUE(away) << away.error().message;
  Cut across = test::straight_cut(tool_named("burr-round-5"), {-4, 0, -1}, {4, 0, -1}, {0, 0, -1}, 3);
  across.author = surgeon;
  across.body = BodyId{1};
  across.lease_epoch = room.lease_epoch(surgeon);
  commit_cut(room, across);

  const RoomSeq back[] = {away->room_seq};
  ASSERT_TRUE(room.undo(surgeon, back));
  EXPECT_GT(room.field().solid_mm({-3, 0, -0.5}), 0.0) << "the cut also took bone of the removed body";
  const RoomSeq whole[] = {split->room_seq};
  ASSERT_TRUE(room.undo(surgeon, whole));
  EXPECT_EQ(room.field_hash(), bone_after({cuts[0], cuts[1], across}));
}

TEST(RoomScene, KeepsWhatWasSetAndTakesItBack) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  SceneItem guide;
  guide.tool = tool_named("guide-1").hash();
  guide.pose_bone_item = pose_along({1, 2, 0}, {0, 0, -1});
  const auto set = room.set_item(surgeon, guide);
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->item, 1u);
  ASSERT_EQ(room.items().size(), 1u);
  EXPECT_EQ(room.items()[0].set_at, set->room_seq.value);

  SceneItem moved = room.items()[0];
  moved.seated = true;
  moved.pose_bone_item.position_mm.x() = 3;
  ASSERT_TRUE(room.set_item(surgeon, moved));
  EXPECT_EQ(room.items()[0].pose_bone_item.position_mm.x(), 3);
  EXPECT_FALSE(room.items()[0].seated) << "the item has no pins, so its own claim does not count";
  ASSERT_TRUE(room.undo_last(surgeon, 1, {}));
  EXPECT_EQ(room.items()[0].pose_bone_item.position_mm.x(), 1);
  EXPECT_EQ(room.lease_epoch(surgeon), 1u) << "no bone came back";
  ASSERT_TRUE(room.redo_last(surgeon, 1));
  EXPECT_EQ(room.items()[0].pose_bone_item.position_mm.x(), 3);

  const auto second = room.set_item(surgeon, guide);
  EXPECT_EQ(second->item, 2u);
  ASSERT_TRUE(room.remove_item(surgeon, 1));
  EXPECT_FALSE(room.remove_item(surgeon, 1)) << "it was removed already";
  ASSERT_EQ(room.items().size(), 1u);
  EXPECT_EQ(room.items()[0].id, 2u);
  ASSERT_TRUE(room.undo_last(surgeon, 1, {}));
  EXPECT_EQ(room.items().size(), 2u);
}

TEST(RoomScene, PinsFixAGuideUntilOneIsDrawn) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const Tool block = tool_named("guide-2");
  SceneItem guide;
  guide.tool = block.hash();
  guide.pose_bone_item = pose_along({1, 2, 0}, {0, 0, -1});
  const std::uint32_t id = room.set_item(surgeon, guide)->item;
  const GuideShape shape = guide_shape(block);
  ASSERT_GE(shape.pin_holes.size(), 2u);
  std::vector<std::uint32_t> pins;
  for (std::size_t hole = 0; hole < 2; ++hole) {
    EXPECT_FALSE(room.items()[0].seated);
    const GuideBore& bore = shape.pin_holes[hole];
    SceneItem pin;
    pin.tool = tool_named("pin-1").hash();
    pin.pose_bone_item = guide.pose_bone_item *
                         Pose{bore.entry_mm + (bore.length_mm + 20.0) * bore.direction, Eigen::Quaterniond::Identity()};
    const auto set = room.set_item(surgeon, pin);
    ASSERT_TRUE(set) << set.error().message;
    pins.push_back(set->item);
  }
  EXPECT_TRUE(room.items()[0].seated) << "the pins came after the guide and fix it";
  SceneItem moved = room.items()[0];
  moved.pose_bone_item.position_mm.x() += 2.0;
  const RoomSeq before = room.room_seq();
  const auto refused = room.set_item(surgeon, moved);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("pin"), std::string::npos) << refused.error().message;
  EXPECT_FALSE(room.remove_item(surgeon, id)) << "a fixed guide cannot be removed either";
  EXPECT_EQ(room.room_seq(), before) << "a refused event gets no sequence number";
  ASSERT_TRUE(room.remove_item(surgeon, pins[0]));
  EXPECT_FALSE(room.items()[0].seated);
  ASSERT_TRUE(room.set_item(surgeon, moved));
  ASSERT_TRUE(room.undo_last(surgeon, 2, {}));
  EXPECT_TRUE(room.items()[0].seated) << "the pin is back";
}

TEST(RoomScene, AScrewGoesByItsThread) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const Tool tool = tool_named("screw-1");
  SceneItem screw;
  screw.tool = tool.hash();
  screw.pose_bone_item = pose_along({1, 2, -4}, {0, 0, -1});
  screw.id = room.set_item(surgeon, screw)->item;
  SceneItem deeper = screw;
  deeper.turns = 3;
  EXPECT_FALSE(room.set_item(surgeon, deeper)) << "it was turned without moving along its axis";
  deeper.pose_bone_item.position_mm.z() -= 3 * tool.thread_pitch_mm;
  EXPECT_TRUE(room.set_item(surgeon, deeper));
  deeper.pose_bone_item.position_mm.x() += 1.0;
  EXPECT_FALSE(room.set_item(surgeon, deeper)) << "it was moved out of its hole";
}

// A cup of 50 mm touches the flat face of the block only at its pole.
TEST(RoomScene, ATrialImplantIsSeatedWhereItFits) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  SceneItem cup;
  cup.tool = tool_named("trial-cup-50").hash();
  cup.pose_bone_item = pose_along({0, 0, 0}, {0, 0, -1});
  cup.seated = true;
  ASSERT_TRUE(room.set_item(surgeon, cup));
  EXPECT_FALSE(room.items()[0].seated);
}

TEST(RoomScene, RefusesItemsThatCannotStandHere) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  SceneItem item;
  item.tool = tool_named("pin-1").hash();
  const auto refused = [&](const std::function<void(SceneItem&)>& change) {
    SceneItem bad = item;
    change(bad);
    return !room.set_item(surgeon, bad).has_value();
  };
  EXPECT_TRUE(refused([](SceneItem& i) { i.body = BodyId{1}; }));
  EXPECT_TRUE(refused([](SceneItem& i) { i.tool.bytes[0] ^= 1; }));
  EXPECT_TRUE(refused([](SceneItem& i) { i.id = 4; }));
  EXPECT_TRUE(refused([](SceneItem& i) { i.pose_bone_item.position_mm.x() = 900; }));
  EXPECT_FALSE(room.set_item(AuthorId{9}, item));
  EXPECT_EQ(room.room_seq().value, 1u) << "only the join of the surgeon";
}

TEST(RoomScene, AnItemGoesWithItsBody) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  ASSERT_TRUE(room.split(BodyId{0}, {half(room.bone(), true)}, room.bone_epoch()));
  SceneItem screw;
  screw.tool = tool_named("screw-1").hash();
  screw.body = BodyId{1};
  ASSERT_TRUE(room.set_item(surgeon, screw));
  ASSERT_TRUE(room.remove_body(surgeon, BodyId{1}));
  EXPECT_TRUE(room.items().empty());
  ASSERT_TRUE(room.undo_last(surgeon, 1, {}));
  EXPECT_EQ(room.items().size(), 1u);
}

TEST(RoomTools, AToolIsAddedOnceAndCutsFromThenOn) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  Tool burr = tool_named("burr-round-5");
  burr.name = "burr-of-the-test";
  burr.diameter_mm = burr.cutting_length_mm = 4.2;
  Cut cut = test::straight_cut(burr, {0, 0, 0}, {1, 0, 0}, {0, 0, -1});
  cut.author = surgeon;
  EXPECT_EQ(room.submit(cut)->rejection, Rejection::tool);
  const auto added = room.add_tool(surgeon, burr);
  ASSERT_TRUE(added) << added.error().message;
  EXPECT_EQ(added->room_seq.value, 3u);
  EXPECT_EQ(added->tool->hash, burr.hash());
  cut.author_seq = 2;
  cut.lease_epoch = room.lease_epoch(surgeon);
  commit_cut(room, cut);

  EXPECT_EQ(room.add_tool(surgeon, burr)->room_seq, RoomSeq{}) << "the tool is known, so there is no event";
  EXPECT_EQ(room.add_tool(surgeon, tool_named("drill-3.2"))->room_seq, RoomSeq{});
  burr.diameter_mm = burr.cutting_length_mm = 4.4;
  EXPECT_EQ(room.add_tool(surgeon, burr).error().code, ErrorCode::exists) << "another tool has that name";
  EXPECT_FALSE(room.add_tool(AuthorId{9}, burr));
  EXPECT_EQ(room.room_seq().value, 4u);
}

TEST(RoomResume, GoesOnFromWhatWasSaved) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const auto cuts = strokes(surgeon, 6, 42);
  for (int i = 0; i < 3; ++i) commit_cut(room, cuts[static_cast<std::size_t>(i)]);
  ASSERT_TRUE(room.split(BodyId{0}, {half(room.bone(), true)}, room.bone_epoch()));
  SavedFields saved;
  saved.case_hash = room.bone().hash();
  saved.kernel_version = kKernelVersion;
  saved.room_seq = room.room_seq();
  saved.bodies = room.bodies();
  for (const BodyId body : saved.bodies)
    for (const FieldLeaf& leaf : room.find_field(body)->leaves()) saved.leaves.push_back(leaf);
  SceneItem pin;
  Tool tool = tool_named("pin-1");
  tool.name = "pin-of-ours";
  tool.diameter_mm += 0.5;
  saved.tools = {tool};
  pin.id = 7;
  pin.body = BodyId{1};
  pin.tool = tool.hash();
  pin.pose_bone_item = pose_along({3, 2, -4}, {0, 0, -1});
  saved.items = {pin};

  Result<Room> resumed = Room::resume(test_block(), saved);
  ASSERT_TRUE(resumed) << resumed.error().message;
  EXPECT_EQ(resumed->field_hash(), room.field_hash());
  EXPECT_EQ(resumed->room_seq(), room.room_seq());
  const AuthorId again = resumed->join(MemberKind::surgeon);
  EXPECT_EQ(resumed->undo_last(again, 1, {}).error().code, ErrorCode::unavailable)
      << "events from before cannot be undone";
  for (int i = 3; i < 6; ++i) {
    Cut cut = cuts[static_cast<std::size_t>(i)];
    commit_cut(room, cut);
    cut.author = again;
    cut.author_seq = static_cast<std::uint64_t>(i) - 2;
    commit_cut(*resumed, cut);
  }
  EXPECT_EQ(resumed->field_hash(), room.field_hash());
  ASSERT_TRUE(room.undo_last(surgeon, 2, {}));
  ASSERT_TRUE(resumed->undo_last(again, 2, {}));
  EXPECT_EQ(resumed->field_hash(), room.field_hash()) << "an undo rebuilds from the loaded field";
  EXPECT_EQ(resumed->items(), saved.items);
  pin.id = 0;
  EXPECT_EQ(resumed->set_item(again, pin)->item, 8u) << "item numbers are not used twice";
  EXPECT_NE(resumed->tools()->find(tool.hash()), nullptr);
  ASSERT_TRUE(resumed->remove_item(again, 7));
  ASSERT_TRUE(resumed->undo_last(again, 1, {}));
  EXPECT_EQ(resumed->items().size(), 2u);
  ASSERT_TRUE(resumed->remove_body(again, BodyId{1}));

  SavedFields other = saved;
  other.case_hash.bytes[0] ^= 1;
  EXPECT_EQ(Room::resume(test_block(), other).error().code, ErrorCode::unsupported);
  other = saved;
  other.tools.clear();
  EXPECT_EQ(Room::resume(test_block(), other).error().code, ErrorCode::invalid_input) << "the pin names no known tool";
  other = saved;
  other.tools[0].name = "pin-1";
  EXPECT_EQ(Room::resume(test_block(), other).error().code, ErrorCode::exists);
  other = saved;
  ++other.kernel_version;
  EXPECT_EQ(Room::resume(test_block(), other).error().code, ErrorCode::unsupported);
}

}  // namespace
}  // namespace osteon
