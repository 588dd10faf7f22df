// The haptic client's own copy of the bone: what the room has committed, and on top what this client has cut and the
// room has not yet confirmed. Both by the same kernel, so without unconfirmed cuts it is the server's to the last bit.
// Order does not matter to a field, so a confirmation changes nothing in the prediction; after rejections, undo and
// splits, which are rare, the leaves that they touched are taken from the committed field and what is still pending is
// cut again. Every body gets every cut, as in the room.
#pragma once
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <vector>

#include "common/volume/cut_field.hpp"

namespace osteon::haptic {

struct ChangedLeaves {
  int level = 0;
  std::vector<Coord> origins;
};

// Not synchronised: one thread.
class Replica {
 public:
  Replica(const Case& bone, BodyId body, std::shared_ptr<const ToolBox> tools = builtin_tool_box());
  Replica(Replica&&) noexcept = default;
  Replica& operator=(Replica&&) noexcept = default;

  void restore(const FieldLeaf& leaf);                       // part of the field at the time of joining
  void joined(RoomSeq contained) { room_seq_ = contained; }  // all leaves were given
  void add_own(const Cut& cut);                              // predicted at once
  // In room_seq order, and nothing for a place that was passed; own ones leave the prediction.
  void commit(RoomSeq place, const Cut& cut, bool own);
  // Of our own: what it took comes back with settle(). False when it was no longer pending, as after an undo.
  bool reject(RoomSeq place, std::uint64_t author_seq);
  // Part of an event that changed the bone otherwise: leaves as they are committed now, and the bodies that exist.
  void change(RoomSeq place, std::span<const BodyId> bodies, std::span<const FieldLeaf> leaves);
  // The room takes no cut of an earlier lease any more: what was predicted under one falls.
  void lease(std::uint64_t epoch);
  void note(RoomSeq place) { room_seq_ = std::max(room_seq_, place); }  // of an event that leaves the bone as it is
  // The room as it is at `contained`, whatever was held before: after the line to it was lost. `leaves`: all that are
  // stored. Own cuts up to `decided` are in them, or were rejected. Only what differs changes, so that bone that is the
  // same stays under the tool.
  void renew(RoomSeq contained, std::span<const BodyId> bodies, std::span<const FieldLeaf> leaves,
             std::uint64_t decided);
  void settle();  // after a batch of the above, before predicted() is asked
  // At the end of a session: own cuts that the room has not confirmed fall. Gives how many they were.
  std::size_t drop_unconfirmed();
  // What has changed in predicted bodies since the last call.
  [[nodiscard]] std::vector<ChangedLeaves> take_changes();

  // Predicted, in the order of their ids, at least one. What is solid is the least of theirs.
  [[nodiscard]] std::vector<const CutField*> bodies() const;
  [[nodiscard]] const CutField& predicted() const { return bodies_.begin()->second.predicted; }  // of the first body
  [[nodiscard]] const CutField& committed() const { return bodies_.begin()->second.committed; }
  [[nodiscard]] Digest hash() const;         // field_hash of all predicted bodies: the room's when nothing is pending
  [[nodiscard]] double removed_mm3() const;  // from all predicted bodies together
  [[nodiscard]] RoomSeq room_seq() const { return room_seq_; }
  [[nodiscard]] std::uint64_t last_own() const { return last_own_; }  // newest own cut that is in predicted()
  [[nodiscard]] std::size_t unconfirmed() const { return pending_.size(); }
  [[nodiscard]] std::uint64_t rejected() const { return rejected_; }
  [[nodiscard]] std::uint64_t cut_again() const { return cut_again_; }  // pending cuts, for the sake of rejected ones

 private:
  struct Body {
    CutField committed, predicted;
  };
  struct Pending {
    Cut cut;
    std::vector<Coord> changed;  // leaves of predicted bodies that it changed
  };
  using Place = std::pair<int, Coord>;  // a leaf: level and origin

  Body& body(BodyId id);  // made when it is not there
  std::vector<Coord> predict(const Cut& cut);
  void fall(const Pending& pending);

  Case bone_;
  std::shared_ptr<const ToolBox> tools_;
  std::map<BodyId, Body> bodies_;
  std::deque<Pending> pending_;  // own, in order
  std::set<Place> undone_;       // leaves of predicted bodies that hold what fell since settle()
  bool again_ = false;           // leaves were set or bodies made since settle(): what is pending is not in them
  std::vector<ChangedLeaves> changes_;
  RoomSeq room_seq_;
  std::uint64_t last_own_ = 0, rejected_ = 0, cut_again_ = 0;
};

}  // namespace osteon::haptic
