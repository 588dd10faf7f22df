// A client's own copy of the bone: what the room rejects comes back, and everything else equals the room's bone.
#include "common/volume/replica.hpp"

#include <gtest/gtest.h>

#include "tests/support/scenes/bones.hpp"

namespace osteon::test {
namespace {

TEST(Replica, ARejectedCutComesBack) {
  const Case bone = plain_block(12.0, 30.0, 0.5);
  Replica replica(bone, BodyId{});
  const Tool tool = *find_tool("drill-3.2");
  const auto cut_at = [&](std::uint64_t seq, double x) {
    Cut cut;
    cut.author = AuthorId{1};
    cut.author_seq = seq;
    cut.tool = tool.hash();
    cut.level = tool.cut_level;
    cut.path = {quantise(pose_along({x, 0, 0}, -Vec3::UnitZ())), quantise(pose_along({x, 0, -3}, -Vec3::UnitZ()))};
    return cut;
  };
  replica.add_own(cut_at(1, -3));
  replica.add_own(cut_at(2, 3));
  EXPECT_GT(replica.predicted().solid_mm({3, 0, -1}), 0.0);
  EXPECT_LT(replica.committed().solid_mm({3, 0, -1}), 0.0);
  (void)replica.take_changes();
  replica.commit(RoomSeq{1}, cut_at(1, -3), true);
  replica.reject(RoomSeq{2}, 2);
  replica.settle();
  EXPECT_LT(replica.predicted().solid_mm({3, 0, -1}), 0.0);
  EXPECT_GT(replica.predicted().solid_mm({-3, 0, -1}), 0.0);
  EXPECT_FALSE(replica.take_changes().empty());
  EXPECT_EQ(replica.unconfirmed(), 0u);
  EXPECT_EQ(replica.predicted().hash(), replica.committed().hash());
}

// After a lost connection, a cut may be sent and answered twice. The second answer may come after the cut was undone.
TEST(Replica, AnAnswerThatComesAgainBringsNothingBack) {
  const Case bone = plain_block(12.0, 30.0, 0.5);
  const Tool tool = *find_tool("drill-3.2");
  Cut cut;
  cut.author = AuthorId{1};
  cut.author_seq = 1;
  cut.tool = tool.hash();
  cut.level = tool.cut_level;
  cut.path = {quantise(pose_along({0, 0, 0}, -Vec3::UnitZ())), quantise(pose_along({0, 0, -3}, -Vec3::UnitZ()))};
  CutField field(bone, BodyId{});
  const Digest uncut = field.hash();
  std::vector<FieldLeaf> before;
  for (const Coord origin : field.apply(cut).changed_leaves) before.push_back({BodyId{}, cut.level, origin, {}});
  for (FieldLeaf& leaf : before) CutField(bone, BodyId{}).read(leaf);
  Replica replica(bone, BodyId{});
  replica.add_own(cut);
  replica.commit(RoomSeq{1}, cut, true);
  EXPECT_EQ(replica.hash(), field.hash());
  const BodyId bodies[] = {BodyId{}};
  replica.change(RoomSeq{2}, bodies, before);
  replica.settle();
  EXPECT_EQ(replica.hash(), uncut);
  replica.commit(RoomSeq{1}, cut, true);
  replica.settle();
  EXPECT_EQ(replica.hash(), uncut);
  EXPECT_EQ(replica.committed().hash(), uncut);
  EXPECT_EQ(replica.room_seq(), RoomSeq{2});
}

// Several rejections in sequence, among own and other cuts through the same bone. The result is the committed field
// with the pending cuts. The pending cuts are applied again once, the committed ones not at all.
TEST(Replica, RejectionsInARowAreSettledOnce) {
  const Case bone = plain_block(12.0, 30.0, 0.5);
  const Tool tool = *find_tool("drill-3.2");
  const auto cut_at = [&](std::uint64_t author, std::uint64_t seq, double x) {
    Cut cut;
    cut.author = AuthorId{author};
    cut.author_seq = seq;
    cut.tool = tool.hash();
    cut.level = tool.cut_level;
    cut.path = {quantise(pose_along({x, 0, 0}, -Vec3::UnitZ())), quantise(pose_along({x, 0, -3}, -Vec3::UnitZ()))};
    return cut;
  };
  Replica replica(bone, BodyId{});
  CutField expected(bone, BodyId{});
  std::uint64_t place = 0;
  for (int i = 0; i < 20; ++i) {
    replica.commit(RoomSeq{++place}, cut_at(2, 1 + i, -4.0 + 0.1 * i), false);
    expected.apply(cut_at(2, 1 + i, -4.0 + 0.1 * i));
  }
  // 1 to 6 overlap. What 5 would take is already gone by 2, which is rejected.
  const double x[] = {-2.5, 0.0, 0.6, 2.5, 0.1, 3.5};
  for (std::uint64_t seq = 1; seq <= 6; ++seq) replica.add_own(cut_at(1, seq, x[seq - 1]));
  (void)replica.take_changes();
  replica.reject(RoomSeq{++place}, 2);
  replica.reject(RoomSeq{++place}, 3);
  replica.commit(RoomSeq{++place}, cut_at(2, 21, 4.0), false);
  expected.apply(cut_at(2, 21, 4.0));
  replica.reject(RoomSeq{++place}, 4);
  replica.settle();
  EXPECT_EQ(replica.committed().hash(), expected.hash());
  for (const std::uint64_t seq : {1, 5, 6}) expected.apply(cut_at(1, seq, x[seq - 1]));
  EXPECT_EQ(replica.predicted().hash(), expected.hash());
  EXPECT_EQ(replica.cut_again(), 3u);
  // A cut that removed again what a rejected one had removed may be rejected later.
  replica.reject(RoomSeq{++place}, 5);
  replica.settle();
  replica.commit(RoomSeq{++place}, cut_at(1, 1, x[0]), true);
  replica.commit(RoomSeq{++place}, cut_at(1, 6, x[5]), true);
  EXPECT_EQ(replica.unconfirmed(), 0u);
  EXPECT_EQ(replica.predicted().hash(), replica.committed().hash());
}

}  // namespace
}  // namespace osteon::test
