#include <gtest/gtest.h>

#include <random>

#include "common/field/kernel.hpp"
#include "common/volume/cut_history.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

using test::plain_block;
using test::straight_cut;

// A cut or a mask, as in a room.
struct Change {
  RoomSeq place;
  Cut cut;
  std::vector<FieldLeaf> mask;
};

// Drills and burrs at random positions of a block, on all levels, and masks of random values on random leaves.
std::vector<Change> random_changes(std::mt19937& random, int count) {
  std::uniform_real_distribution<double> across(-6.0, 6.0), depth(-6.0, 0.0), tilt(-0.4, 0.4);
  std::vector<Change> changes;
  for (int i = 0; i < count; ++i) {
    Change change{{static_cast<std::uint64_t>(10 + 3 * i)}, {}, {}};
    if (i % 5 == 4) {
      for (int n = 0; n < 6; ++n) {
        const int level = static_cast<int>(random() % 3);
        const auto leaf = [&] { return kLeafSize * (static_cast<std::int32_t>(random() % 4) - 2); };
        const Coord origin{leaf(), leaf(), leaf() - 8};
        if (std::ranges::any_of(change.mask,
                                [&](const FieldLeaf& m) { return m.level == level && m.origin == origin; }))
          continue;
        const std::int32_t band = band_quanta(level_pitch_mm(0.5, level));
        FieldLeaf mask{{}, level, origin, std::vector<std::int16_t>(kLeafVoxels, static_cast<std::int16_t>(-band))};
        if (n != 0)  // the first is all removed
          for (std::int16_t& v : mask.values)
            v = static_cast<std::int16_t>(static_cast<std::int32_t>(random() % static_cast<unsigned>(2 * band + 1)) -
                                          band);
        change.mask.push_back(mask);
      }
    } else {
      Tool tool = *find_tool(i % 2 ? "drill-3.2" : "burr-round-5");
      const Vec3 from{across(random), across(random), depth(random)};
      change.cut = straight_cut(tool, from, from + Vec3{tilt(random), tilt(random), tilt(random)} * 3.0,
                                {tilt(random), tilt(random), -1.0});
      change.cut.level = i % 3;
    }
    changes.push_back(change);
  }
  return changes;
}

void apply(CutField& field, const Change& change, CutHistory* history = nullptr) {
  if (change.cut.path.empty()) {
    for (const FieldLeaf& leaf : change.mask) field.merge(leaf);
    if (history) history->add_mask(change.place, change.mask);
    return;
  }
  const CutReport report = field.apply(change.cut);
  EXPECT_EQ(report.reached_leaves, field.reach(change.cut));
  if (history) history->add(change.place, change.cut, report.reached_leaves);
}

TEST(CutHistory, UndoLeavesWhatOnlyTheOthersWouldHaveCut) {
  const Case bone = plain_block(16.0, 8.0, 0.5);
  std::mt19937 random(7);
  const std::vector<Change> changes = random_changes(random, 25);
  CutField field(bone, {});
  CutHistory history;
  for (const Change& change : changes) apply(field, change, &history);
  const Digest whole = field.hash();

  for (int round = 0; round < 12; ++round) {
    std::vector<RoomSeq> places;
    CutField others(bone, {});
    for (const Change& change : changes) {
      if (random() % 3 == 0)
        places.push_back(change.place);
      else
        apply(others, change);
    }
    history.undo(field, places);
    EXPECT_EQ(field.hash(), others.hash()) << "round " << round;
    // No leaf is left that no remaining event has made.
    for (const RoomSeq place : places) EXPECT_TRUE(history.undone(place));
    std::ranges::shuffle(places, random);
    history.redo(field, places);
    EXPECT_EQ(field.hash(), whole) << "round " << round;
  }
}

TEST(CutHistory, UndoOfEverythingLeavesNoLeafAndTheCaseAsItWas) {
  const Case bone = plain_block(16.0, 8.0, 0.5);
  std::mt19937 random(8);
  CutField field(bone, {});
  CutHistory history;
  std::vector<RoomSeq> places;
  for (const Change& change : random_changes(random, 15)) {
    apply(field, change, &history);
    places.push_back(change.place);
  }
  history.undo(field, places);
  EXPECT_TRUE(field.leaves().empty());
  EXPECT_EQ(field.hash(), CutField(bone, {}).hash());
  EXPECT_EQ(field.removed_mm3(), 0.0);
}

TEST(CutHistory, ACutHiddenByAnotherComesBackWhenThatIsUndone) {
  const Case bone = plain_block(16.0, 8.0, 0.5);
  CutField field(bone, {}), small(bone, {});
  CutHistory history;
  const Cut wide = straight_cut(*find_tool("burr-round-5"), {0, 0, -3}, {0, 0, -3}, {0, 0, -1});
  Cut inner = straight_cut(*find_tool("burr-round-3.2"), {0, 0, -2.5}, {0, 0, -2.5}, {0, 0, -1});
  inner.level = wide.level;
  history.add({1}, wide, field.apply(wide).reached_leaves);
  const CutReport hidden = field.apply(inner);
  history.add({2}, inner, hidden.reached_leaves);
  const RoomSeq first{1};
  history.undo(field, {&first, 1});
  small.apply(inner);
  EXPECT_EQ(field.hash(), small.hash());
}

// A fragment's history: cuts that both bodies had before are undone in each of them separately.
TEST(CutHistory, AForkGoesItsOwnWay) {
  const Case bone = plain_block(20.0, 8.0, 0.5);
  const Tool burr = *find_tool("burr-round-5");
  std::vector<Cut> cuts;
  for (int i = 0; i < 4; ++i)
    cuts.push_back(straight_cut(burr, {-6.0 + 3.0 * i, -2, -1}, {-5.0 + 3.0 * i, 2, -1}, {0, 0, -1}));
  CutField parent(bone, {}), piece(bone, {});
  CutHistory history;
  const auto cut = [&](CutField& field, CutHistory& its, std::size_t i) {
    its.add({i + 1}, cuts[i], field.apply(cuts[i]).reached_leaves);
  };
  for (CutField* field : {&parent, &piece}) (void)field->apply(cuts[0]), (void)field->apply(cuts[1]);
  for (std::size_t i = 0; i < 2; ++i) history.add({i + 1}, cuts[i], parent.reach(cuts[i]));
  CutHistory other = history.fork();
  cut(parent, history, 2);
  cut(piece, other, 3);
  EXPECT_EQ(history.size(), 3u);
  EXPECT_EQ(other.size(), 3u);
  EXPECT_FALSE(other.contains({3}));
  const auto only = [&](std::initializer_list<std::size_t> which) {
    CutField field(bone, {});
    for (const std::size_t i : which) field.apply(cuts[i]);
    return field.hash();
  };
  const RoomSeq first{1}, second{2};
  history.undo(parent, {&first, 1});
  EXPECT_TRUE(history.undone(first));
  EXPECT_FALSE(other.undone(first));
  EXPECT_EQ(parent.hash(), only({1, 2}));
  EXPECT_EQ(piece.hash(), only({0, 1, 3}));
  other.undo(piece, {&second, 1});
  EXPECT_EQ(piece.hash(), only({0, 3}));
  history.redo(parent, {&first, 1});
  EXPECT_EQ(parent.hash(), only({0, 1, 2}));
}

TEST(CutHistory, CostsWhatWasTouchedAndNamesTheLeavesThatChanged) {
  const Case bone = plain_block(40.0, 8.0, 0.5);
  CutField field(bone, {});
  CutHistory history;
  const Tool drill = *find_tool("drill-3.2");
  std::uint64_t place = 0;
  // A row of holes that do not touch each other. Each has three cuts.
  for (int hole = 0; hole < 4; ++hole)
    for (int step = 0; step < 3; ++step) {
      const Vec3 at{-15.0 + 10.0 * hole, 0.0, -2.0 * step};
      const Cut cut = straight_cut(drill, at, at - Vec3{0, 0, 2.0}, {0, 0, -1});
      history.add({++place}, cut, field.apply(cut).reached_leaves);
    }
  const std::vector<FieldLeaf> before = field.leaves();
  const RoomSeq last_of_second{6};
  const auto changed = history.undo(field, {&last_of_second, 1});
  // Only its own leaves change, and no cut of another hole.
  EXPECT_LE(history.last_cost().cuts, 2u);
  EXPECT_GT(history.last_cost().leaves, 0u);
  EXPECT_LE(history.last_cost().leaf_cuts, 2 * history.last_cost().leaves);
  ASSERT_EQ(changed.size(), 1u);
  EXPECT_EQ(changed[0].level, drill.cut_level);
  for (const FieldLeaf& leaf : before) {
    FieldLeaf now{leaf.body, leaf.level, leaf.origin, {}};
    field.read(now);
    EXPECT_EQ(now.values != leaf.values, std::ranges::binary_search(changed[0].origins, leaf.origin));
  }
  // Undoing it again, or undoing an unknown cut, changes nothing.
  EXPECT_TRUE(history.undo(field, {&last_of_second, 1}).empty());
  const RoomSeq unknown{99};
  EXPECT_TRUE(history.undo(field, {&unknown, 1}).empty());
  EXPECT_TRUE(history.redo(field, {&unknown, 1}).empty());
  EXPECT_EQ(history.last_cost().leaves, 0u);
}

}  // namespace
}  // namespace osteon
