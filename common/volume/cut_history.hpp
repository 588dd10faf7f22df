// What a body was made by, so that some of it can be taken back: every cut, and every mask by which a split took a
// piece away, with the leaves that it reaches. Undo rebuilds those leaves from what remains.
#pragma once
#include <array>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/volume/cut_field.hpp"

namespace osteon {

// Leaves of one level, by origin.
struct LevelLeaves {
  int level = 0;
  std::vector<Coord> origins;  // sorted, samples of the level
  friend bool operator==(const LevelLeaves&, const LevelLeaves&) = default;
};

// What one undo or redo did.
struct RebuildCost {
  std::size_t leaves = 0;     // rebuilt
  std::size_t cuts = 0;       // evaluated again, each on its part of the leaves
  std::size_t leaf_cuts = 0;  // leaf and cut pairs evaluated: what the time goes with
  std::size_t masks = 0;      // leaves of masks merged again
};

// Owners: the split that made a piece and the histories that hold it; never changed.
using Mask = std::shared_ptr<const std::vector<FieldLeaf>>;

// A field whose every change is in the history, and whose others came as a mask (a piece's first state), is after any
// undo and redo what a fresh field with only the remaining events would be. Not synchronised: one thread writes, or
// several read.
class CutHistory {
 public:
  // An event at `place` that was applied to the field: all later calls name it by its place, which must be new.
  // `leaves`: all that the cut can change, CutReport::reached_leaves or CutField::reach(); those that it did change are
  // not enough, because another cut that is taken back may have hidden the rest.
  void add(RoomSeq place, const Cut& cut, const std::vector<Coord>& leaves);
  void add_mask(RoomSeq place, Mask mask);  // R = min(R, mask); sorted by (level, origin)
  void add_mask(RoomSeq place, std::vector<FieldLeaf> mask);
  // Another history with the same events, that goes its own way from here. What was added before is shared, so this
  // costs the same for any number of events.
  [[nodiscard]] CutHistory fork();

  [[nodiscard]] bool contains(RoomSeq place) const;
  [[nodiscard]] bool undone(RoomSeq place) const;
  [[nodiscard]] const Cut* find_cut(RoomSeq place) const;  // null: unknown, or a mask; until the next add()
  [[nodiscard]] std::size_t size() const;

  // Takes events back, or applies them again, and returns the leaves that changed, by level. Places that are unknown,
  // or in that state already, are passed over. The field must be the one that the events were applied to.
  std::vector<LevelLeaves> undo(CutField& field, std::span<const RoomSeq> places);
  std::vector<LevelLeaves> redo(CutField& field, std::span<const RoomSeq> places);
  // The same without a field: for one that will be brought as it is after them.
  void note_undone(std::span<const RoomSeq> places, bool undone);
  [[nodiscard]] const RebuildCost& last_cost() const { return cost_; }

 private:
  struct Event {
    Cut cut;  // without path: a mask
    Mask mask;
  };
  // Events in a row, and which of their cuts reach a leaf, in the order in which they were added. Masks name their
  // leaves.
  struct Part {
    std::map<RoomSeq, Event> events;
    std::array<std::unordered_map<Coord, std::vector<RoomSeq>, CoordHash>, kLevels> reach;
  };
  using Leaves = std::array<std::vector<Coord>, kLevels>;

  [[nodiscard]] const Part* part_of(RoomSeq place) const;  // null: unknown
  std::vector<LevelLeaves> rebuild(CutField& field, std::span<const RoomSeq> places, bool undone);
  [[nodiscard]] static Leaves reached(const CutField& field, const Part& part, RoomSeq place);
  void apply_again(CutField& field, const Leaves& leaves);

  std::vector<std::shared_ptr<const Part>> shared_;  // with forks; never changed
  Part own_;
  std::set<RoomSeq> undone_;
  RebuildCost cost_;
};

}  // namespace osteon
