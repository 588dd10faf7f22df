// A room on a bone that contains metal: no cut removes any metal.
#include <gtest/gtest.h>

#include "server/room/room.hpp"
#include "tests/unit/room/cuts.hpp"

namespace osteon {
namespace {

// The block with a plate that begins 5 mm below the upper face.
Case plate_block() {
  return test::marked_block(24.0, 12.0, test::kBlockPitch_mm,
                            [](const Vec3& p) { return p.z() <= -5.0 ? Tissue::metal : Tissue::none; });
}

struct MetalRoom {
  Room room{plate_block()};
  AuthorId hand = room.join(MemberKind::surgeon);
  std::uint64_t next = 0;
  Outcome cut(const Vec3& from, const Vec3& to, const char* tool = "burr-round-5") {
    Cut made = test::straight_cut(test::tool_named(tool), from, to, {0, 0, -1}, ++next);
    made.author = hand;
    made.lease_epoch = room.lease_epoch(hand);
    return *room.submit(made);
  }
};

TEST(RoomMetal, RejectsWhatWouldTakeMetalAway) {
  MetalRoom all;
  EXPECT_TRUE(all.cut({0, 0, 1}, {0, 0, -4}).committed()) << "the cut is in the bone above the plate";
  const Digest before = all.room.field_hash();
  const std::uint64_t lease = all.room.lease_epoch(all.hand);
  (void)all.room.take_stale_blocks();

  const Outcome into = all.cut({0, 0, -4}, {0, 0, -6});
  EXPECT_EQ(into.rejection, Rejection::metal) << sentence(into.rejection);
  EXPECT_EQ(all.cut({-5, 0, -6}, {5, 0, -6}).rejection, Rejection::metal) << "the cut goes sideways through the plate";
  EXPECT_EQ(all.cut({3, 3, -7}, {3, 3, -7}, "drill-3.2").rejection, Rejection::metal)
      << "the drill stands in the plate";
  EXPECT_EQ(all.room.field_hash(), before);
  EXPECT_EQ(all.room.stale_blocks(), 0u);
  EXPECT_EQ(all.room.counts().rejected, 3u);
  EXPECT_GT(all.room.lease_epoch(all.hand), lease) << "cuts predicted before the rejection are void";
  EXPECT_TRUE(all.cut({0, 0, -4}, {4, 0, -4.5}).committed()) << "the cut is beside the plate";
}

// A replay of the entries makes the same room again, with the rejections.
TEST(RoomMetal, ReplaysFromItsLogEntries) {
  MetalRoom all;
  (void)all.cut({0, 0, 1}, {0, 0, -4});
  (void)all.cut({0, 0, -4}, {0, 0, -7});
  (void)all.cut({3, 0, 1}, {3, 0, -4});
  Room again(plate_block());
  int metal = 0;
  for (const LogEntry& entry : all.room.take_entries()) {
    if (const auto* rejection = std::get_if<RejectionEntry>(&entry.what))
      metal += rejection->reason == Rejection::metal;
    ASSERT_TRUE(again.replay(entry));
  }
  EXPECT_EQ(metal, 1);
  EXPECT_EQ(again.field_hash(), all.room.field_hash());
  EXPECT_EQ(again.room_hash(), all.room.room_hash());
}

// Every rejection has a sentence of its own.
TEST(Rejections, EachHasASentence) {
  for (int i = 0; i < kRejections; ++i)
    for (int k = 0; k < i; ++k)
      EXPECT_NE(sentence(static_cast<Rejection>(i)), sentence(static_cast<Rejection>(k))) << i;
  EXPECT_EQ(sentence(static_cast<Rejection>(kRejections)), "the reason is unknown");
}

}  // namespace
}  // namespace osteon
