// The haptic client's own copy of the bone: what the room has committed, and on top what this client has cut and the
// room has not yet confirmed. Both by the same kernel, so without unconfirmed cuts it is the server's to the last bit.
// Order does not matter to a field, so a confirmation changes nothing in the prediction; after rejections, which are
// rare, the leaves that they touched are taken from the committed field and what is still pending is cut again.
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
  void reject(RoomSeq place, std::uint64_t author_seq);         // of our own: what it took comes back with settle()
  void settle();  // after a batch of the above, before predicted() is asked
  // What has changed in predicted() since the last call.
  [[nodiscard]] std::vector<ChangedLeaves> take_changes();

  [[nodiscard]] const CutField& predicted() const { return predicted_; }
  [[nodiscard]] const CutField& committed() const { return committed_; }
  [[nodiscard]] RoomSeq room_seq() const { return room_seq_; }
  [[nodiscard]] std::uint64_t last_own() const { return last_own_; }  // newest own cut that is in predicted()
  [[nodiscard]] std::size_t unconfirmed() const { return pending_.size(); }
  [[nodiscard]] std::uint64_t rejected() const { return rejected_; }
  [[nodiscard]] std::uint64_t cut_again() const { return cut_again_; }  // pending cuts, for the sake of rejected ones

 private:
  struct Pending {
    Cut cut;
    std::vector<Coord> changed;  // leaves of predicted_ that it changed
  };

  BodyId body_;
  CutField committed_, predicted_;
  std::deque<Pending> pending_;         // own, in order
  std::vector<ChangedLeaves> undone_;   // by rejections since settle(): still cut in predicted_
  std::vector<ChangedLeaves> changes_;
  RoomSeq room_seq_;
  std::uint64_t last_own_ = 0, rejected_ = 0, cut_again_ = 0;
};

}  // namespace osteon::haptic
