// The history of a body, for undo and redo. It stores every cut, and every mask by which a split removed a piece, with
// the leaves that each reaches. Undo rebuilds those leaves from the remaining events.
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

// Cost of one undo or redo.
struct RebuildCost {
  std::size_t leaves = 0;     // rebuilt
  std::size_t cuts = 0;       // evaluated again, each on its part of the leaves
  std::size_t leaf_cuts = 0;  // evaluated pairs of leaf and cut; they determine the time
  std::size_t masks = 0;      // leaves of masks that were merged again
};

// Owners: the split that made a piece, and the histories that contain it. Immutable.
using Mask = std::shared_ptr<const std::vector<FieldLeaf>>;

// Every change of the field must be in the history, or be part of the field's first state as a mask. Then after any
// undo and redo the field equals a fresh field with only the remaining events. Not synchronised: either one thread
// writes, or several read.
class CutHistory {
 public:
  // Adds an event that was applied to the field. `seq` is its sequence number, which must be new; later calls name
  // the event by it. `leaves`: all leaves that the cut can change, CutReport::reached_leaves or CutField::reach(). The
  // leaves that it did change are not enough, because a cut that is undone later may have hidden the rest.
  void add(RoomSeq seq, const Cut& cut, const std::vector<Coord>& leaves);
  void add_mask(RoomSeq seq, Mask mask);  // R = min(R, mask); sorted by (level, origin)
  void add_mask(RoomSeq seq, std::vector<FieldLeaf> mask);
  // Another history with the same events, independent from here on. Earlier events are shared, so the cost does not
  // depend on their number.
  [[nodiscard]] CutHistory fork();

  [[nodiscard]] bool contains(RoomSeq seq) const;
  [[nodiscard]] bool undone(RoomSeq seq) const;
  [[nodiscard]] const Cut* find_cut(RoomSeq seq) const;  // null: unknown, or a mask; valid until the next add()
  [[nodiscard]] std::size_t size() const;

  // Undoes events, or applies them again, and returns the leaves that changed, by level. Unknown events, and events
  // already in that state, are skipped. The field must be the one that the events were applied to.
  std::vector<LevelLeaves> undo(CutField& field, std::span<const RoomSeq> seqs);
  std::vector<LevelLeaves> redo(CutField& field, std::span<const RoomSeq> seqs);
  // The same without a field, which the caller will update later.
  void note_undone(std::span<const RoomSeq> seqs, bool undone);
  [[nodiscard]] const RebuildCost& last_cost() const { return cost_; }

 private:
  struct Event {
    Cut cut;  // without path: a mask
    Mask mask;
  };
  // A group of events, and which of their cuts reach a leaf, in the order in which they were added. Masks list their
  // leaves themselves.
  struct Part {
    std::map<RoomSeq, Event> events;
    std::array<std::unordered_map<Coord, std::vector<RoomSeq>, CoordHash>, kLevels> reach;
  };
  using Leaves = std::array<std::vector<Coord>, kLevels>;

  [[nodiscard]] const Part* part_of(RoomSeq seq) const;  // null: unknown
  std::vector<LevelLeaves> rebuild(CutField& field, std::span<const RoomSeq> seqs, bool undone);
  [[nodiscard]] static Leaves reached(const CutField& field, const Part& part, RoomSeq seq);
  void apply_again(CutField& field, const Leaves& leaves);

  std::vector<std::shared_ptr<const Part>> shared_;  // shared with forks; immutable
  Part own_;
  std::set<RoomSeq> undone_;
  RebuildCost cost_;
};

}  // namespace osteon
