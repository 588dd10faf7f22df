// The haptic client's own copy of the bone: what the room has committed, and on top what this client has cut and the
// room has not yet confirmed. Both by the same kernel, so without unconfirmed cuts it is the server's to the last bit.
// One field holds both: order does not matter to it, so a confirmation changes nothing; only a rejection, which is rare,
// makes the field again from what was committed.
#pragma once
#include <deque>
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
  Replica(const Case& bone, BodyId body);

  void restore(const FieldLeaf& leaf);                          // part of the field at the time of joining
  void joined(RoomSeq contained) { room_seq_ = contained; }     // all leaves were given
  void add_own(const Cut& cut);                                 // predicted at once
  void commit(RoomSeq place, const Cut& cut, bool own);         // in room_seq order; own ones leave the prediction
  void reject(RoomSeq place, std::uint64_t author_seq);         // of our own: what it took comes back
  // What has changed in predicted() since the last call.
  [[nodiscard]] std::vector<ChangedLeaves> take_changes();

  [[nodiscard]] const CutField& predicted() const { return predicted_; }
  // What the room has committed, made anew: slow.
  [[nodiscard]] CutField committed() const;
  [[nodiscard]] RoomSeq room_seq() const { return room_seq_; }
  [[nodiscard]] std::uint64_t last_own() const { return last_own_; }  // newest own cut that is in predicted()
  [[nodiscard]] std::size_t unconfirmed() const { return pending_.size(); }
  [[nodiscard]] std::uint64_t rejected() const { return rejected_; }

 private:
  Case bone_;
  BodyId body_;
  CutField predicted_;
  std::vector<FieldLeaf> joined_;     // as the field was on joining
  std::vector<Cut> committed_cuts_;   // since then
  std::deque<Cut> pending_;  // own, in order
  std::vector<ChangedLeaves> changes_;
  RoomSeq room_seq_;
  std::uint64_t last_own_ = 0, rejected_ = 0;
};

}  // namespace osteon::haptic
