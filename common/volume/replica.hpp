// A client's own copy of the bone. It holds what the room has committed, and on top the cuts of this client
// that the room has not confirmed. Both are computed by the same kernel. So without unconfirmed cuts the copy equals
// the server's to the last bit.
//
// The order of cuts does not matter to a field, so a confirmation changes nothing in the prediction. Rejections, undo
// and splits are rare. After them, the leaves that they touched are copied from the committed field, and the pending
// cuts are applied again. Every body gets every cut, as in the room.
#pragma once
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <vector>

#include "common/volume/cut_field.hpp"

namespace osteon {

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
  // In room_seq order; entries already passed do nothing. Own cuts leave the prediction.
  void commit(RoomSeq seq, const Cut& cut, bool own);
  // For an own cut: what it removed comes back with settle(). Returns false when the cut was no longer pending, for
  // example after an undo.
  bool reject(RoomSeq seq, std::uint64_t author_seq);
  // Part of an event that changed the bone in another way: leaves as committed now, and the bodies that exist.
  void change(RoomSeq seq, std::span<const BodyId> bodies, std::span<const FieldLeaf> leaves);
  // The room no longer takes cuts of an earlier lease; what was predicted under one is dropped.
  void lease(std::uint64_t epoch);
  void note(RoomSeq seq) { room_seq_ = std::max(room_seq_, seq); }  // of an event that leaves the bone as it is
  // Replaces everything by the room as it is at `contained`, after its connection was lost. `leaves`: all that are
  // stored. Own cuts up to `decided` are in them, or were rejected. Only differences are changed, so that unchanged
  // bone stays under the tool.
  void renew(RoomSeq contained, std::span<const BodyId> bodies, std::span<const FieldLeaf> leaves,
             std::uint64_t decided);
  void settle();  // call after a batch of the above, before predicted()
  // At the end of a session: drops own cuts that the room has not confirmed. Returns their number.
  std::size_t drop_unconfirmed();
  // What has changed in predicted bodies since the last call.
  [[nodiscard]] std::vector<ChangedLeaves> take_changes();

  // Predicted bodies in the order of their ids, at least one. The bone's solid distance is the least of theirs.
  [[nodiscard]] std::vector<const CutField*> bodies() const;
  [[nodiscard]] const CutField& predicted() const { return bodies_.begin()->second.predicted; }  // of the first body
  [[nodiscard]] const CutField& committed() const { return bodies_.begin()->second.committed; }
  [[nodiscard]] Digest hash() const;         // field_hash of all predicted bodies: the room's when nothing is pending
  [[nodiscard]] double removed_mm3() const;  // from all predicted bodies together
  [[nodiscard]] RoomSeq room_seq() const { return room_seq_; }
  [[nodiscard]] std::uint64_t last_own() const { return last_own_; }  // newest own cut that is in predicted()
  [[nodiscard]] std::size_t unconfirmed() const { return pending_.size(); }
  [[nodiscard]] std::uint64_t rejected() const { return rejected_; }
  // Pending cuts that were applied again because of rejected ones.
  [[nodiscard]] std::uint64_t cut_again() const { return cut_again_; }

 private:
  struct Body {
    CutField committed, predicted;
  };
  struct Pending {
    Cut cut;
    std::vector<Coord> changed;  // leaves of predicted bodies that it changed
  };
  using Place = std::pair<int, Coord>;  // a leaf: level and origin

  Body& body(BodyId id);  // creates the body if it is missing
  std::vector<Coord> predict(const Cut& cut);
  void fall(const Pending& pending);

  Case bone_;
  std::shared_ptr<const ToolBox> tools_;
  std::map<BodyId, Body> bodies_;
  std::deque<Pending> pending_;  // own cuts, in order
  std::set<Place> undone_;       // leaves of predicted bodies that hold cuts dropped since settle()
  bool again_ = false;           // leaves were set or bodies created since settle(): pending cuts are not in them
  std::vector<ChangedLeaves> changes_;
  RoomSeq room_seq_;
  std::uint64_t last_own_ = 0, rejected_ = 0, cut_again_ = 0;
};

}  // namespace osteon
