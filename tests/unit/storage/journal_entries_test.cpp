// The log entries of a room. After a round trip through bytes, a replay of them makes the same room again, from the
// beginning or from any sequence number.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>

#include "common/wire/encoded_cut.hpp"
#include "server/storage/journal_entries.hpp"
#include "tests/support/trials.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/room/parts.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::strokes;
using test::test_block;
using test::tool_named;

Fragment half(const Case& bone, bool upper) {
  Fragment fragment = test::part(bone, [&](int x) { return (x >= 0) == upper; });
  (upper ? fragment.bounds.min_mm : fragment.bounds.max_mm).x() = 0.0;
  return fragment;
}

// Two authors in a seeded mixture: they cut, undo, redo, saw the bone apart, remove pieces, set items, mark, and make
// mistakes.
class BusyRoom {
 public:
  explicit BusyRoom(unsigned seed) : room(test_block()), random_(seed) {
    for (std::size_t i = 0; i < 2; ++i)
      hands_[i] = room.join(MemberKind::surgeon, static_cast<std::uint32_t>(i + 1), Digest{{1}});
    for (std::size_t i = 0; i < 2; ++i) cuts_[i] = strokes(hands_[i], 200, seed + static_cast<unsigned>(i) * 100);
  }

  void act() {
    room.set_time(room.time() + 8ms);
    const std::size_t who = random_() % 2;
    const AuthorId hand = hands_[who];
    switch (random_() % 12) {
      case 0:
        (void)room.undo_last(hand, 1 + random_() % 3, {});
        return;
      case 1:
        (void)room.redo_last(hand, 1 + random_() % 2);
        return;
      case 2:
        if (room.bodies().size() == 1)
          (void)room.split(BodyId{0}, {half(room.bone(), upper_ = !upper_)}, room.bone_epoch());
        return;
      case 3:
        if (room.bodies().size() > 1) (void)room.remove_body(hand, room.bodies()[random_() % room.bodies().size()]);
        return;
      case 4: {
        SceneItem guide;
        guide.body = room.bodies().front();
        guide.tool = tool_named("guide-1").hash();
        guide.pose_bone_item =
            pose_along({0.1 * static_cast<double>(random_() % 50), 2, 0}, Vec3{0.1, 0.2, -1}.normalized());
        const auto standing = room.items();
        if (!standing.empty() && random_() % 2) guide.id = standing.front().id;
        (void)room.set_item(hand, guide);
        return;
      }
      case 5:
        if (const auto standing = room.items(); !standing.empty()) (void)room.remove_item(hand, standing.back().id);
        return;
      case 6: {
        (void)room.mark(hand, "step " + std::to_string(room.room_seq().value));
        Tool tool = tool_named("drill-3.2");
        tool.name = "drill-" + std::to_string(room.room_seq().value);
        tool.diameter_mm = 3.3 + 0.01 * static_cast<double>(random_() % 50);
        (void)room.add_tool(hand, tool);
        return;
      }
      default: {
        Cut& cut = cuts_[who][room.decided(hand)];
        cut.lease_epoch = random_() % 10 == 0 ? 0 : room.lease_epoch(hand);
        if (random_() % 10 == 0) cut.spindle_rpm = 1'000'000;
        ASSERT_TRUE(room.submit(cut));
      }
    }
  }

  Room room;

 private:
  std::mt19937 random_;
  std::array<AuthorId, 2> hands_;
  std::array<std::vector<Cut>, 2> cuts_;
  bool upper_ = false;
};

Room begun_like(const Room& room) {
  const Result<RoomGenesis> genesis = genesis_from_bytes(to_bytes(genesis_of(Room(test_block()), "a room")));
  EXPECT_TRUE(genesis) << genesis.error().message;
  Result<Room> made = begin_room(test_block(), *genesis, {});
  EXPECT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->genesis(), room.genesis());
  return std::move(*made);
}

// The entry as a journal stores it.
LogEntry through_bytes(const LogEntry& entry) {
  Result<LogEntry> read = entry_from_bytes(entry.seq, entry.at, to_bytes(entry));
  EXPECT_TRUE(read) << read.error().message;
  return std::move(*read);
}

// Compares the whole room, also what shows only later: the room after an undo of everything, and after a redo of that.
void expect_same(Room& one, Room& other) {
  ASSERT_EQ(one.room_hash(), other.room_hash());
  ASSERT_EQ(one.bodies(), other.bodies());
  ASSERT_EQ(one.items(), other.items());
  ASSERT_EQ(one.marks(), other.marks());
  for (int round = 0; round < 2; ++round) {
    for (Room* room : {&one, &other}) {
      if (round == 0)
        (void)room->undo_to(AuthorId{1}, RoomSeq{2});
      else
        (void)room->redo_last(AuthorId{1}, 1);
    }
    ASSERT_EQ(one.room_hash(), other.room_hash()) << (round == 0 ? "after an undo of everything" : "after its redo");
  }
}

class LogEntries : public ::testing::TestWithParam<unsigned> {};

TEST_P(LogEntries, ReplayedMakeTheSameRoom) {
  BusyRoom busy(GetParam());
  Room replayed = begun_like(busy.room);
  std::size_t entries = 0;
  for (int i = 0; i < 60; ++i) {
    busy.act();
    for (const LogEntry& entry : busy.room.take_entries()) {
      const Result<void> followed = replayed.replay(through_bytes(entry));
      ASSERT_TRUE(followed) << followed.error().message;
      ++entries;
    }
    ASSERT_EQ(replayed.room_hash(), busy.room.room_hash()) << "event " << i << ", entry " << entries;
    ASSERT_EQ(replayed.room_seq(), busy.room.room_seq());
  }
  EXPECT_EQ(entries, busy.room.room_seq().value) << "every sequence number has a log entry";
  EXPECT_TRUE(replayed.take_entries().empty()) << "a replayed decision makes no new entry";
  expect_same(busy.room, replayed);
}

// The field of a checkpoint and the entries before it, which are not evaluated again. Then the entries after it.
TEST_P(LogEntries, GoOnFromACheckpoint) {
  BusyRoom busy(GetParam());
  std::vector<LogEntry> before, after;
  std::vector<FieldLeaf> fields;
  for (int i = 0; i < 60; ++i) {
    busy.act();
    std::ranges::move(busy.room.take_entries(), std::back_inserter(i < 40 ? before : after));
    if (i == 39) fields = busy.room.all_leaves();
  }
  Room recovered = begun_like(busy.room);
  for (const LogEntry& entry : before) ASSERT_TRUE(recovered.replay(through_bytes(entry), Room::Fields::leave));
  ASSERT_TRUE(recovered.set_fields(fields));
  for (const LogEntry& entry : after) {
    const Result<void> followed = recovered.replay(through_bytes(entry));
    ASSERT_TRUE(followed) << followed.error().message;
  }
  expect_same(busy.room, recovered);
}

INSTANTIATE_TEST_SUITE_P(Seeds, LogEntries, ::testing::Range(1u, 1 + test::trials(8, 3)));

// A cut that was encoded before has the same bytes in the journal.
TEST(LogEntryBytes, ContainACutAsItWasEncoded) {
  for (const std::uint64_t number : {1ull, 200ull, 1ull << 33}) {
    const Cut cut = test::straight_cut(find_tool("burr-round-5").value(), {0, 0, 0}, {1, 2, 3}, {0, 0, -1}, number);
    for (const AuthorId author : {AuthorId{}, AuthorId{number}}) {
      const LogEntry plain{RoomSeq{number}, 1s, author, CutEntry{cut}};
      const LogEntry with_bytes{RoomSeq{number}, 1s, author, CutEntry{cut, wire::encoded(cut)}};
      EXPECT_EQ(to_bytes(with_bytes), to_bytes(plain));
    }
  }
}

TEST(RoomReplay, TakesOnlyTheNextLogEntry) {
  BusyRoom busy(3);
  for (int i = 0; i < 20; ++i) busy.act();
  const std::vector<LogEntry> entries = busy.room.take_entries();
  Room replayed = begun_like(busy.room);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Digest before = replayed.room_hash();
    if (i + 1 < entries.size()) {
      EXPECT_FALSE(replayed.replay(entries[i + 1])) << "an entry is missing";
    }
    if (i > 0) {
      EXPECT_FALSE(replayed.replay(entries[i - 1])) << "the entry was replayed already";
    }
    EXPECT_EQ(replayed.room_hash(), before);
    ASSERT_TRUE(replayed.replay(entries[i]));
  }
}

// A journal may be damaged or forged although its chain holds. No entry may name something that does not exist.
TEST(RoomReplay, RefusesALogEntryThatNamesWhatIsNotThere) {
  Room room(test_block());
  const AuthorId hand = room.join(MemberKind::surgeon);
  const auto cuts = strokes(hand, 3, 4);
  ASSERT_TRUE(room.submit(cuts[0]));
  const Digest before = room.room_hash();
  Cut of_nobody = cuts[1], of_no_tool = cuts[1], of_no_body = cuts[1], too_early = cuts[2], far = cuts[1];
  of_nobody.author = AuthorId{9};
  of_no_tool.tool.bytes[3] ^= 1;
  of_no_body.body = BodyId{4};
  far.path.back().position[0] = INT32_MAX;
  const Mask torn =
      std::make_shared<const std::vector<FieldLeaf>>(std::vector<FieldLeaf>{{BodyId{0}, 0, {1, 0, 0}, {5}}});
  const Mask whole = std::make_shared<const std::vector<FieldLeaf>>();
  SceneItem item;
  item.id = 1;
  item.tool = tool_named("guide-1").hash();
  item.set_at = 3;
  SceneItem of_gone_body = item, of_another_number = item, of_another_place = item;
  of_gone_body.body = BodyId{3};
  of_another_number.id = 2;
  of_another_place.set_at = 2;
  const auto mask_at = [](int level, Coord origin) {
    return std::make_shared<const std::vector<FieldLeaf>>(std::vector<FieldLeaf>{{BodyId{0}, level, origin, {5}}});
  };
  constexpr std::int32_t kFurthest = std::numeric_limits<std::int32_t>::max() - 7;
  const CoordBox everywhere{{INT32_MIN, INT32_MIN, INT32_MIN}, {INT32_MAX, INT32_MAX, INT32_MAX}};
  const decltype(LogEntry::what) impossible[] = {
      CutEntry{of_nobody},
      CutEntry{of_no_tool},
      CutEntry{of_no_body},
      CutEntry{too_early},
      CutEntry{far},
      JoinEntry{hand, MemberKind::surgeon, 0, {}},
      JoinEntry{AuthorId{7}, MemberKind::watcher, 0, {}},
      RejectionEntry{hand, 3, {}, Rejection::place},
      RejectionEntry{hand, 2, {}, Rejection::none},
      RejectionEntry{hand, 2, {}, static_cast<Rejection>(kRejections)},
      SplitEntry{BodyId{3}, whole, {}},
      SplitEntry{BodyId{0}, torn, {}},
      SplitEntry{BodyId{0}, nullptr, {}},
      SplitEntry{BodyId{0}, whole, {{BodyId{5}, {}, whole}}},
      SplitEntry{BodyId{0}, mask_at(0, {kFurthest, 0, 0}), {}},
      SplitEntry{BodyId{0}, mask_at(2, {0, -4096, 0}), {}},
      SplitEntry{BodyId{0}, whole, {{BodyId{1}, {}, mask_at(1, {0, 0, kFurthest})}}},
      SplitEntry{BodyId{0}, whole, {{BodyId{1}, everywhere, whole}}},
      UndoEntry{{}},
      UndoEntry{{RoomSeq{1}}},
      UndoEntry{{RoomSeq{9}}},
      UndoEntry{{RoomSeq{2}, RoomSeq{2}}},
      RedoEntry{{}, {}},
      RedoEntry{{RoomSeq{2}}, {}},
      RedoEntry{{RoomSeq{8}}, {}},
      RemoveBodyEntry{BodyId{0}},
      RemoveBodyEntry{BodyId{6}},
      ItemEntry{1, std::nullopt},
      ItemEntry{2, item},
      ItemEntry{1, of_gone_body},
      ItemEntry{1, of_another_number},
      ItemEntry{1, of_another_place},
      ToolEntry{tool_named("guide-1")},
      MarkEntry{""},
      MarkEntry{std::string(kMostLabelBytes + 1, 'x')}};
  for (std::size_t i = 0; i < std::size(impossible); ++i) {
    EXPECT_FALSE(room.replay({RoomSeq{3}, 1s, hand, impossible[i]})) << "entry " << i;
    EXPECT_EQ(room.room_hash(), before) << "entry " << i;
  }
  EXPECT_TRUE(room.replay({RoomSeq{3}, 1s, hand, CutEntry{cuts[1]}}));
}

// Also where the sum of the two times would not overflow.
TEST(RoomReplay, RefusesATimeBeforeTheLastLogEntryOrBeyondAnyRooms) {
  Room room(test_block());
  const AuthorId hand = room.join(MemberKind::surgeon);
  ASSERT_TRUE(room.replay({RoomSeq{2}, 2s, hand, MarkEntry{"here"}}));
  const Digest before = room.room_hash();
  for (const std::chrono::nanoseconds at : {std::chrono::nanoseconds::min(), std::chrono::nanoseconds(-1s),
                                            std::chrono::nanoseconds(1999ms), std::chrono::nanoseconds::max()}) {
    EXPECT_FALSE(room.replay({RoomSeq{3}, at, hand, MarkEntry{"there"}})) << at.count();
    EXPECT_EQ(room.room_hash(), before);
    EXPECT_EQ(room.time(), 2s);
  }
  EXPECT_TRUE(room.replay({RoomSeq{3}, 2s, hand, MarkEntry{"there"}})) << "two entries may have the same time";
}

TEST(RoomReplay, RefusesARedoThatNamesOneEventTwice) {
  Room room(test_block());
  const AuthorId hand = room.join(MemberKind::surgeon);
  const auto cuts = strokes(hand, 2, 4);
  ASSERT_TRUE(room.submit(cuts[0]) && room.submit(cuts[1]));
  ASSERT_TRUE(room.undo_last(hand, 1, {}) && room.undo_last(hand, 1, {}));
  const RoomSeq first{2}, second{3}, undo{4}, next_undo{5};
  const Digest before = room.room_hash();
  for (const RedoEntry& redo : {RedoEntry{{undo, undo}, {second}}, RedoEntry{{undo, next_undo}, {first, second}},
                                RedoEntry{{undo}, {second, second}}, RedoEntry{{next_undo, undo}, {second, first}}}) {
    EXPECT_FALSE(room.replay({RoomSeq{6}, 1s, hand, redo}));
    EXPECT_EQ(room.room_hash(), before);
  }
  EXPECT_TRUE(room.replay({RoomSeq{6}, 1s, hand, RedoEntry{{next_undo, undo}, {first, second}}}));
}

TEST(RoomReplay, RefusesFieldsThatAreNoneOfTheBones) {
  Room room(test_block());
  const Digest before = room.room_hash();
  const std::int32_t furthest = std::numeric_limits<std::int32_t>::max() - 7;
  for (const FieldLeaf& leaf :
       {FieldLeaf{BodyId{0}, 0, {furthest, 0, 0}, {5}}, FieldLeaf{BodyId{0}, 2, {0, 0, -4096}, {5}},
        FieldLeaf{BodyId{0}, kLevels, {}, {5}}, FieldLeaf{BodyId{0}, 0, {}, {}}, FieldLeaf{BodyId{1}, 0, {}, {5}}}) {
    EXPECT_FALSE(room.set_fields({&leaf, 1}));
    EXPECT_EQ(room.room_hash(), before);
  }
}

TEST(RoomReplay, TakesNoMoreItemsThanTheRoomGives) {
  Room room(test_block());
  SceneItem item;
  item.tool = tool_named("guide-1").hash();
  for (item.id = 1; item.id <= kMostItems; ++item.id) {
    item.set_at = item.id;
    ASSERT_TRUE(room.replay({RoomSeq{item.id}, 1s, {}, ItemEntry{item.id, item}})) << item.id;
  }
  item.set_at = item.id;
  EXPECT_FALSE(room.replay({RoomSeq{item.id}, 1s, {}, ItemEntry{item.id, item}}));
  --item.id;
  EXPECT_TRUE(room.replay({RoomSeq{kMostItems + 1}, 1s, {}, ItemEntry{item.id, item}})) << "an existing item may move";
}

TEST(RoomLease, FallsWithARejectionForItsAuthorAlone) {
  Room room(test_block());
  const AuthorId one = room.join(MemberKind::surgeon), other = room.join(MemberKind::surgeon);
  auto cuts = strokes(one, 4, 1), of_other = strokes(other, 1, 2);
  cuts[0].level = kLevels;
  const Outcome fell = room.submit(cuts[0]).value();
  EXPECT_EQ(fell.rejection, Rejection::level);
  EXPECT_GT(fell.lease_epoch, 1u);
  EXPECT_EQ(room.lease_epoch(one), fell.lease_epoch);
  // The cut under way was made on top of the rejected one, so it is rejected too. That does not void the cuts after it.
  EXPECT_EQ(room.submit(cuts[1])->rejection, Rejection::lease);
  EXPECT_EQ(room.submit(cuts[2])->rejection, Rejection::lease);
  cuts[3].lease_epoch = fell.lease_epoch;
  EXPECT_TRUE(room.submit(cuts[3])->committed());
  EXPECT_TRUE(room.submit(of_other[0])->committed()) << "the other author's cuts are on other bone";
}

TEST(RoomLease, TakesNoMoreToolTimeThanHasPassed) {
  Room room(test_block(), {.time_slack = 100ms});
  const AuthorId hand = room.join(MemberKind::surgeon);
  auto cuts = strokes(hand, 40, 1);
  std::size_t taken = 0;
  room.set_time(1s);
  for (Cut& cut : cuts) {
    cut.path_us = 50'000;
    cut.lease_epoch = room.lease_epoch(hand);
    if (!room.submit(cut)->committed()) break;
    ++taken;
  }
  EXPECT_EQ(taken, 22u) << "1.1 s of cuts of 50 ms each, and none of those that take longer";
  EXPECT_EQ(room.counts().rejected, 1u);
}

// Each cut moves 1 mm. The box around the tool and its path bounds what the kernel examines.
TEST(RoomLimits, BoundWhatIsSweptOverTime) {
  const auto taken_in_a_entry = [](double voxels_per_s) {
    Room room(test_block(), {.swept_voxels_per_s = voxels_per_s});
    const AuthorId hand = room.join(MemberKind::surgeon);
    const Tool burr = tool_named("burr-round-5");
    std::size_t taken = 0;
    for (std::uint64_t i = 1; i <= 100; ++i) {
      Cut cut = test::straight_cut(burr, {0, 0, 0}, {1, 0, 0}, {0, 0, -1}, i);
      cut.author = hand;
      cut.lease_epoch = room.lease_epoch(hand);
      if (room.submit(cut)->committed()) ++taken;
    }
    EXPECT_EQ(room.counts().rejected, 100 - taken);
    room.set_time(1h);
    Cut cut = test::straight_cut(burr, {0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 101);
    cut.author = hand;
    cut.lease_epoch = room.lease_epoch(hand);
    EXPECT_TRUE(room.submit(cut)->committed()) << "the limit recovers with time";
    return taken;
  };
  const std::size_t few = taken_in_a_entry(1e5), more = taken_in_a_entry(2e5);
  EXPECT_GT(few, 0u);
  EXPECT_LT(more, 100u);
  EXPECT_NEAR(static_cast<double>(more), 2.0 * static_cast<double>(few), 2.0);
}

// Each sample stands for a 64th of the bur. Eight samples are allowed without energy: 1.1 J. A block of 1.9 g/cm3 has
// an ultimate stress of 130 N/mm2. A bur of 5 mm that is wholly in it needs at least 130 N/mm2 * pi/6 * 125 mm3 = 8.5
// J, and half of that if half of it is in air.
TEST(RoomLimits, BoundTheEnergyOfACutByTheMotor) {
  const auto rejection_of = [](const std::string& tool, const Vec3& at, double power_w, double blow_j,
                               std::uint32_t path_us) {
    Room room(test_block(), {.power_w = power_w, .blow_j = blow_j});
    Cut cut = test::straight_cut(tool_named(tool), at, at, {0, 0, -1});
    cut.author = room.join(MemberKind::surgeon);
    cut.path_us = path_us;
    return room.submit(cut)->rejection;
  };
  const Vec3 deep{0, 0, -8};
  EXPECT_EQ(rejection_of("burr-round-5", deep, 1e-9, 9.5, 8000), Rejection::none);
  EXPECT_EQ(rejection_of("burr-round-5", deep, 1e-9, 6.0, 8000), Rejection::power);
  EXPECT_EQ(rejection_of("burr-round-5", {0, 0, -2.5}, 1e-9, 5.0, 8000), Rejection::none)
      << "half of the bur is in air";
  EXPECT_EQ(rejection_of("burr-round-5", {0, 0, -2.5}, 1e-9, 2.0, 8000), Rejection::power);
  EXPECT_EQ(rejection_of("burr-round-5", {0, 0, 6}, 1e-9, 0.0, 8000), Rejection::none) << "the bur is in air";
  // 8.5 J in 20 ms are 425 W.
  EXPECT_EQ(rejection_of("burr-round-5", deep, 500.0, 0.0, 20'000), Rejection::none);
  EXPECT_EQ(rejection_of("burr-round-5", deep, 350.0, 0.0, 20'000), Rejection::power);
  EXPECT_EQ(rejection_of("burr-round-5", deep, 0.0, 0.0, 0), Rejection::none) << "there is no bound";
}

// What the first cut took and the motor has not given yet counts against the second. Each takes 8.5 J.
// - Without power between them, a second cut exceeds 9.5 J and the tolerance of 1.1 J.
// - 100 W give 4 J in the 40 ms of a cut. The first cut owes 8.5 J, so the second brings the debt to 8.5 - 4 + 8.5 = 13
//   J. The second may owe what a blow gives, 5.5 J, and 4 J of its own time, and the tolerance: 10.6 J.
// - After 90 ms in air, the motor has given all of the first.
TEST(RoomLimits, CarryTheEnergyThatTheMotorHasNotGivenYet) {
  struct Way {
    double power_w, blow_j;
    std::uint32_t path_us, air_us;
    Rejection second;
  };
  const Way ways[] = {{1e-9, 9.5, 8000, 0, Rejection::power},
                      {100.0, 5.5, 40'000, 0, Rejection::power},
                      {100.0, 5.5, 40'000, 90'000, Rejection::none}};
  for (const Way& way : ways) {
    Room room(test_block(), {.power_w = way.power_w, .blow_j = way.blow_j});
    const AuthorId hand = room.join(MemberKind::surgeon);
    std::uint64_t number = 0;
    const auto cut_at = [&](const Vec3& at, std::uint32_t path_us) {
      Cut cut = test::straight_cut(tool_named("burr-round-5"), at, at, {0, 0, -1}, ++number);
      cut.author = hand;
      cut.path_us = path_us;
      return room.submit(cut)->rejection;
    };
    EXPECT_EQ(cut_at({-6, 0, -6}, way.path_us), Rejection::none);
    if (way.air_us > 0) {
      EXPECT_EQ(cut_at({0, 0, 6}, way.air_us), Rejection::none);
    }
    EXPECT_EQ(cut_at({6, 0, -6}, way.path_us), way.second) << way.power_w << " W, " << way.air_us << " us in air";
  }
}

// The bound holds at any time. A burst is as large after a hundred seconds of the room as at its start, and one that
// has just begun gives what 3 s allow.
TEST(RoomLimits, BoundWhatIsSweptAtAnyTime) {
  const auto taken_at = [](std::chrono::nanoseconds time) {
    Room room(test_block(), {.swept_voxels_per_s = 1e5});
    const AuthorId hand = room.join(MemberKind::surgeon);
    room.set_time(time);
    std::size_t taken = 0;
    for (std::uint64_t i = 1; i <= 100; ++i) {
      Cut cut = test::straight_cut(tool_named("burr-round-5"), {0, 0, 0}, {1, 0, 0}, {0, 0, -1}, i);
      cut.author = hand;
      cut.lease_epoch = room.lease_epoch(hand);
      if (room.submit(cut)->committed()) ++taken;
    }
    return taken;
  };
  EXPECT_GT(taken_at(0s), 0u);
  EXPECT_EQ(taken_at(100s), taken_at(0s));
}

// Bone that is removed already takes no energy.
TEST(RoomLimits, ATurnInItsOwnHoleTakesNoEnergy) {
  Room room(test_block(), {.power_w = 1e-9, .blow_j = 9.5});
  const AuthorId hand = room.join(MemberKind::surgeon);
  for (std::uint64_t i = 1; i <= 5; ++i) {
    Cut cut = test::straight_cut(tool_named("burr-round-5"), {0, 0, -8}, {0, 0, -8}, {0, 0, -1}, i);
    cut.author = hand;
    EXPECT_TRUE(room.submit(cut)->committed()) << i;
  }
  Tool larger = tool_named("burr-round-5");
  larger.name = "burr-of-the-test";
  larger.diameter_mm = larger.cutting_length_mm = 9;
  ASSERT_TRUE(room.add_tool(hand, larger));
  Cut wider = test::straight_cut(larger, {0, 0, -10}, {0, 0, -10}, {0, 0, -1}, 6);
  wider.author = hand;
  EXPECT_EQ(room.submit(wider)->rejection, Rejection::power) << "130 N/mm2 * pi/6 * (729 - 125) mm3 = 41 J";
}

TEST(RoomMark, IsFoundAgainAndUndoneTo) {
  Room room(test_block());
  const AuthorId hand = room.join(MemberKind::surgeon);
  auto cuts = strokes(hand, 6, 8);
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(room.submit(cuts[i])->committed());
  const Digest then = room.field_hash();
  ASSERT_TRUE(room.mark(hand, "before the deep one"));
  for (std::size_t i = 3; i < 6; ++i) ASSERT_TRUE(room.submit(cuts[i])->committed());
  ASSERT_NE(room.field_hash(), then);
  ASSERT_EQ(room.marks().size(), 1u);
  EXPECT_EQ(room.marks()[0].second, "before the deep one");
  const auto undone = room.undo_to(hand, room.marks()[0].first);
  ASSERT_TRUE(undone);
  EXPECT_EQ(undone->seqs.size(), 3u);
  EXPECT_EQ(room.field_hash(), then);
  EXPECT_EQ(room.undo_to(hand, room.marks()[0].first).error().code, ErrorCode::unavailable)
      << "nothing has happened since that could be undone";
  EXPECT_FALSE(room.undo_to(hand, RoomSeq{99}));
  EXPECT_FALSE(room.mark(hand, "")) << "a mark needs a name";
  EXPECT_FALSE(room.mark(AuthorId{}, "nobody's"));
}

TEST(JournalEntries, AreRefusedWhereTheyAreNone) {
  EXPECT_FALSE(entry_from_bytes(RoomSeq{1}, 0s, "\xff\xff"));
  EXPECT_EQ(entry_from_bytes(RoomSeq{1}, 0s, "").error().code, ErrorCode::unsupported);
  EXPECT_FALSE(genesis_from_bytes("\xff\xff"));
  RoomGenesis genesis = genesis_of(Room(test_block()), "a");
  genesis.case_hash.bytes[0] ^= 1;
  EXPECT_EQ(begin_room(test_block(), genesis, {}).error().code, ErrorCode::unsupported);
  genesis = genesis_of(Room(test_block()), "a");
  ++genesis.kernel_version;
  EXPECT_EQ(begin_room(test_block(), genesis, {}).error().code, ErrorCode::unsupported);
  genesis = genesis_of(Room(test_block()), "a");
  genesis.tools.pop_back();
  EXPECT_EQ(begin_room(test_block(), genesis, {}).error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace osteon
