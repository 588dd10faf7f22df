#include "server/room/room.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "tests/unit/room/cuts.hpp"

namespace osteon {
namespace {

using test::strokes;
using test::test_block;

Outcome commit(Room& room, const Cut& cut) {
  const Result<Outcome> outcome = room.submit(cut);
  EXPECT_TRUE(outcome.has_value()) << outcome.error().message;
  EXPECT_TRUE(outcome->committed()) << sentence(outcome->rejection);
  return *outcome;
}

TEST(Room, GivesNoAuthorTwiceAndEveryCutTheNextSequenceNumber) {
  Room room(test_block());
  const AuthorId a = room.join(MemberKind::surgeon), b = room.join(MemberKind::surgeon),
                 c = room.join(MemberKind::watcher);
  EXPECT_NE(a, b);
  EXPECT_NE(b, c);
  EXPECT_TRUE(room.knows(c));
  EXPECT_FALSE(room.knows(AuthorId{c.value + 1}));
  EXPECT_FALSE(room.knows(AuthorId{}));

  const auto of_a = strokes(a, 3, 1), of_b = strokes(b, 3, 2);
  std::uint64_t seq = 3;  // Each join has a sequence number too.
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(commit(room, of_b[static_cast<std::size_t>(i)]).room_seq.value, ++seq);
    EXPECT_EQ(commit(room, of_a[static_cast<std::size_t>(i)]).room_seq.value, ++seq);
  }
  EXPECT_EQ(room.room_seq().value, 9u);
}

// The bone is a function of the set of cuts: any interleaving of two authors leaves the same bone.
TEST(Room, LeavesTheSameBoneForEveryInterleaving) {
  const auto hash_of = [](const std::vector<int>& turns) {
    Room room(test_block());
    std::vector<std::vector<Cut>> entries{strokes(room.join(MemberKind::surgeon), 4, 3),
                                          strokes(room.join(MemberKind::surgeon), 4, 4)};
    std::size_t next[2] = {0, 0};
    for (const int who : turns) commit(room, entries[static_cast<std::size_t>(who)][next[who]++]);
    return room.field_hash();
  };
  const Digest first = hash_of({0, 0, 0, 0, 1, 1, 1, 1});
  EXPECT_EQ(first, hash_of({1, 1, 1, 1, 0, 0, 0, 0}));
  EXPECT_EQ(first, hash_of({0, 1, 1, 0, 1, 0, 0, 1}));
  EXPECT_NE(first, Room(test_block()).field_hash());
}

TEST(Room, AnswersACutSentAgainWithItsFirstOutcome) {
  Room room(test_block());
  auto cuts = strokes(room.join(MemberKind::surgeon), 3, 5);
  cuts[1].level = kLevels;  // It is rejected, and stays so.
  const RoomSeq first = commit(room, cuts[0]).room_seq;
  const Outcome second = room.submit(cuts[1]).value();
  EXPECT_EQ(second.rejection, Rejection::level);
  cuts[2].lease_epoch = second.lease_epoch;
  commit(room, cuts[2]);
  const Digest hash = room.field_hash();

  const Outcome again = room.submit(cuts[0]).value();
  EXPECT_TRUE(again.repeated && again.committed());
  EXPECT_EQ(again.room_seq, first);
  const Outcome rejected_again = room.submit(cuts[1]).value();
  EXPECT_TRUE(rejected_again.repeated);
  EXPECT_EQ(rejected_again.rejection, Rejection::level);
  EXPECT_EQ(rejected_again.room_seq, second.room_seq);
  EXPECT_EQ(room.room_seq().value, 4u);
  EXPECT_EQ(room.field_hash(), hash);
  EXPECT_EQ(room.counts().repeated, 2u);
  // As a client that reconnects is sent them.
  EXPECT_EQ(room.decided_seqs(cuts[0].author, 8), (std::vector<RoomSeq>{first, RoomSeq{}, RoomSeq{4}}));
  EXPECT_EQ(room.decided_seqs(cuts[0].author, 2), (std::vector<RoomSeq>{RoomSeq{}, RoomSeq{4}})) << "only the newest";
  EXPECT_TRUE(room.decided_seqs(AuthorId{9}, 8).empty());
}

TEST(Room, RefusesWhatBreaksTheOrderOfAnAuthor) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon), watcher = room.join(MemberKind::watcher);
  const auto cuts = strokes(surgeon, 3, 6);
  commit(room, cuts[0]);
  const Digest hash = room.field_hash();

  Cut other = cuts[1];
  other.author_seq = 1;
  EXPECT_FALSE(room.submit(other)) << "a decided cut's number with other bytes";
  EXPECT_FALSE(room.submit(cuts[2])) << "a cut is missing";
  Cut zero = cuts[0];
  zero.author_seq = 0;
  EXPECT_FALSE(room.submit(zero));
  Cut watched = cuts[0];
  watched.author = watcher;
  EXPECT_FALSE(room.submit(watched)) << "a watcher does not cut";
  Cut stranger = cuts[0];
  stranger.author = AuthorId{99};
  EXPECT_FALSE(room.submit(stranger));

  EXPECT_EQ(room.counts().refused, 5u);
  EXPECT_EQ(room.room_seq().value, 3u) << "a breach gets no sequence number";
  EXPECT_EQ(room.field_hash(), hash);
  EXPECT_EQ(commit(room, cuts[1]).room_seq.value, 4u) << "the author can go on";
}

// A rejection decides a number as finally as a commit. Another cut under it is a breach, and not the answer's
// repetition.
TEST(Room, RefusesAnotherCutUnderTheNumberOfARejectedOne) {
  Room room(test_block());
  auto cuts = strokes(room.join(MemberKind::surgeon), 2, 13);
  Cut rejected = cuts[0];
  rejected.level = kLevels;
  ASSERT_EQ(room.submit(rejected)->rejection, Rejection::level);
  Cut other = cuts[0];
  other.lease_epoch = room.lease_epoch(other.author);
  EXPECT_FALSE(room.submit(other)) << "its level is fine, but its number is used";
  EXPECT_EQ(room.counts().refused, 1u);
  EXPECT_EQ(room.counts().repeated, 0u);
  EXPECT_TRUE(room.submit(rejected)->repeated) << "the same bytes are answered again";
}

struct Breach {
  const char* name;
  Rejection expected;
  std::function<void(Cut&)> make;
};

class RoomLimits : public ::testing::TestWithParam<Breach> {};

TEST_P(RoomLimits, RejectTheCutAsALogEntryAndLeaveTheBone) {
  Room room(test_block());
  auto cuts = strokes(room.join(MemberKind::surgeon), 2, 7);
  const Digest uncut = room.field_hash();
  GetParam().make(cuts[0]);
  const Result<Outcome> outcome = room.submit(cuts[0]);
  ASSERT_TRUE(outcome.has_value()) << outcome.error().message;
  EXPECT_EQ(outcome->rejection, GetParam().expected) << sentence(outcome->rejection);
  EXPECT_EQ(outcome->room_seq.value, 2u);
  EXPECT_EQ(room.counts().rejected, 1u);
  EXPECT_EQ(room.field_hash(), uncut);
  EXPECT_EQ(room.stale_blocks(), 0u);
  cuts[1].lease_epoch = outcome->lease_epoch;
  EXPECT_EQ(commit(room, cuts[1]).room_seq.value, 3u);
}

QuantisedPose at(const Vec3& tip_mm) { return quantise(pose_along(tip_mm, {0, 0, -1})); }

INSTANTIATE_TEST_SUITE_P(
    Cuts, RoomLimits,
    ::testing::Values(
        Breach{"body", Rejection::body, [](Cut& c) { c.body = BodyId{1}; }},
        Breach{"lease", Rejection::lease, [](Cut& c) { ++c.lease_epoch; }},
        Breach{"unknown_tool", Rejection::tool, [](Cut& c) { c.tool.bytes[0] ^= 1; }},
        Breach{"level_too_fine", Rejection::level, [](Cut& c) { c.level = kLevels; }},
        Breach{"level_negative", Rejection::level, [](Cut& c) { c.level = -1; }},
        Breach{"no_path", Rejection::path, [](Cut& c) { c.path.clear(); }},
        Breach{"long_path", Rejection::path, [](Cut& c) { c.path.assign(65, c.path.front()); }},
        Breach{"null_rotation", Rejection::rotation,
               [](Cut& c) {
                 c.path.back().rotation = {0, 0, 0, 0};
               }},
        Breach{"half_rotation", Rejection::rotation,
               [](Cut& c) {
                 c.path.back().rotation = {0, 0, 0, 16384};
               }},
        Breach{"far_away", Rejection::place,
               [](Cut& c) {
                 c.path = {at({0, 0, 500})};
               }},
        Breach{"end_of_integers", Rejection::place, [](Cut& c) { c.path.back().position[1] = INT32_MIN; }},
        Breach{"long_way", Rejection::sweep,
               [](Cut& c) {
                 c.path = {at({-13, 0, 0}), at({13, 0, 0})};
               }},
        Breach{"to_and_fro", Rejection::sweep,
               [](Cut& c) {
                 c.path.clear();
                 for (int i = 0; i < 60; ++i) c.path.push_back(at({i % 2 ? 0.5 : 0.0, 0, 0}));
               }},
        Breach{"many_turns", Rejection::sweep,
               [](Cut& c) {
                 const Tool drill = test::tool_named("drill-3.2");
                 c.tool = drill.hash();
                 c.path.clear();
                 for (int i = 0; i < 20; ++i)
                   c.path.push_back(quantise(pose_along({0, 0, 0}, i % 2 ? Vec3{1, 0, 0} : Vec3{0, 0, -1})));
               }},
        Breach{"spindle", Rejection::spindle, [](Cut& c) { c.spindle_rpm = 1'000'000; }}),
    [](const auto& test_case) { return std::string(test_case.param.name); });

// The same burr on a finer case: its cuts are stored no finer than kFinestCut_mm.
TEST(Room, TakesNoCutFinerThanTheCaseAllows) {
  Room room(test::plain_block(8.0, 4.0, 0.3));
  auto cuts = strokes(room.join(MemberKind::surgeon), 2, 12);
  const Digest uncut = room.field_hash();
  cuts[0].level = 2;  // 0.075 mm
  EXPECT_EQ(room.submit(cuts[0])->rejection, Rejection::level);
  EXPECT_EQ(room.field_hash(), uncut);
  cuts[1].level = 1;  // 0.15 mm
  cuts[1].lease_epoch = room.lease_epoch(cuts[1].author);
  commit(room, cuts[1]);
}

// Whoever joins at any moment and applies the cuts committed from then on has the server's bone.
TEST(Room, SnapshotAndStreamGiveEveryHolderTheSameHash) {
  Room room(test_block());
  const auto cuts = strokes(room.join(MemberKind::surgeon), 12, 8);
  std::vector<CutField> holders;
  for (const Cut& cut : cuts) {
    CutField& joined = holders.emplace_back(room.bone(), BodyId{0});
    for (const FieldLeaf& leaf : room.field().leaves()) joined.restore(leaf);
    commit(room, cut);
    for (CutField& holder : holders) holder.apply(cut);
  }
  for (const CutField& holder : holders) EXPECT_EQ(holder.hash(), room.field_hash());
}

// Compares two ways to the surface: remaking blocks after every cut, where the newest replaces older ones, and making
// each once at the end.
TEST(RoomSurface, StaleBlocksAreAllThatACutChanges) {
  Room room(test_block());
  const auto cuts = strokes(room.join(MemberKind::surgeon), 10, 9);
  BlockStore live;
  std::set<BlockKey> keys;
  const auto make = [&](BlockStore& store, const BlockKey& key) {
    store.put(key, make_block(room.gather_block(key)));
    keys.insert(key);
  };
  for (const BlockKey& key : room.bone_blocks()) make(live, key);
  ASSERT_FALSE(live.blocks().empty());
  for (const Cut& cut : cuts) {
    commit(room, cut);
    EXPECT_GT(room.stale_blocks(), 0u);
    for (const BlockKey& key : room.take_stale_blocks()) make(live, key);
    EXPECT_EQ(room.stale_blocks(), 0u);
  }
  // Neighbours too: a block that was never stale must not have changed.
  for (BlockKey key : std::set<BlockKey>(keys))
    for (const int step : {-1, 1}) {
      BlockKey beside = key;
      beside.index.x += step;
      keys.insert(beside);
    }
  int fine = 0;
  for (const BlockKey& key : keys) {
    const bool drawn = key.level == 0 || live.blocks().contains(key);
    if (!drawn) continue;
    const BlockPayload anew = make_block(room.gather_block(key));
    const auto kept = live.blocks().find(key);
    EXPECT_EQ(anew.bytes.empty() ? BlockPayload{} : anew,
              kept == live.blocks().end() ? BlockPayload{} : kept->second.payload)
        << "block " << key.index.x << ' ' << key.index.y << ' ' << key.index.z << " of level " << key.level;
    fine += key.level > 0;
  }
  EXPECT_GT(fine, 0) << "a burr's cut is drawn at its own level";
}

TEST(RoomSurface, ACutLeavesFarBlocksAlone) {
  Room room(test_block());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const Tool burr = test::tool_named("burr-round-5");
  Cut cut = test::straight_cut(burr, {-9, -9, -1}, {-9, -9, -1}, {0, 0, -1});
  cut.author = surgeon;
  commit(room, cut);
  // A ball of radius 2.5 mm, with the band and a block around it, stays on its side of the middle.
  for (const BlockKey& key : room.take_stale_blocks()) {
    const double edge_mm = kBlockCells * level_pitch_mm(test::kBlockPitch_mm, key.level);
    EXPECT_LT(key.index.x * edge_mm, 2.0);
    EXPECT_LT(key.index.y * edge_mm, 2.0);
  }
}

TEST(BlockStore, VersionsRiseWithChangesOnly) {
  BlockStore store;
  const BlockKey key{BodyId{0}, 1, {2, 3, 4}};
  EXPECT_EQ(store.put(key, {}), nullptr) << "the block never had a surface";
  const BlockPayload a{{1, 2, 3}}, b{{4, 5}};
  EXPECT_EQ(store.put(key, a)->version, 1u);
  EXPECT_EQ(store.put(key, a), nullptr);
  EXPECT_EQ(store.put(key, b)->version, 2u);
  const StoredBlock* gone = store.put(key, {});
  ASSERT_NE(gone, nullptr) << "the loss of a surface is a change";
  EXPECT_EQ(gone->version, 3u);
}

}  // namespace
}  // namespace osteon
