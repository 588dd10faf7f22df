// What a body was made by, so that some of it can be taken back: every cut, and every mask by which a split took a piece
// away, with the leaves that it reaches. Undo rebuilds those leaves from what remains.
#pragma once
#include <map>
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

// Not synchronised: one thread writes, or several read.
class CutHistory {
 public:
  // An event at `place` that was applied to the field: all later calls name it by its place.
  void add(RoomSeq place, const Cut& cut, const std::vector<Coord>& leaves);       // of cut.level: what it can change
  void add_mask(RoomSeq place, const std::vector<FieldLeaf>& mask);                // R = min(R, mask)

  [[nodiscard]] bool contains(RoomSeq place) const;
  [[nodiscard]] bool undone(RoomSeq place) const;

  // Takes events back, or applies them again, and returns the leaves that changed. Places that are unknown, or in that
  // state already, are passed over. The field must be the one that the events were applied to.
  std::vector<LevelLeaves> undo(CutField& field, std::span<const RoomSeq> places);
  std::vector<LevelLeaves> redo(CutField& field, std::span<const RoomSeq> places);

 private:
  struct Event {
    Cut cut;                      // without path: a mask
    std::vector<FieldLeaf> mask;
    std::vector<LevelLeaves> leaves;
    bool undone = false;
  };
  std::vector<LevelLeaves> rebuild(CutField& field, std::span<const RoomSeq> places, bool undone);

  std::map<RoomSeq, Event> events_;
  // Which events reach a leaf, in the order in which they were added.
  std::array<std::unordered_map<Coord, std::vector<RoomSeq>, CoordHash>, kLevels> reach_;
};

}  // namespace osteon
