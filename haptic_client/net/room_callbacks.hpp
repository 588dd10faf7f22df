// What a haptic client receives from its room.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/field/field_hash.hpp"
#include "common/field/restrictions.hpp"
#include "common/mechanics/compliant_mount.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/tools/scene_item.hpp"

namespace osteon {

// State of a room when all leaves were sent: they contain every event up to `contained`.
struct RoomAtJoin {
  RoomSeq contained;
  std::vector<BodyId> bodies;
  std::uint64_t lease_epoch = 0;
  // The caller's cuts up to this one were decided: they are in the leaves or rejected.
  std::uint64_t decided_author_seq = 0;
  // Sequence numbers of the newest of these cuts; the last is that of decided_author_seq. Null: rejected.
  std::vector<RoomSeq> decided_seqs{};
  // Sequence number of one of these cuts; nothing: the room does not say it.
  [[nodiscard]] std::optional<RoomSeq> seq_of(std::uint64_t author_seq) const {
    const std::uint64_t after = decided_author_seq - author_seq;
    if (author_seq == 0 || author_seq > decided_author_seq || after >= decided_seqs.size()) return std::nullopt;
    return decided_seqs[decided_seqs.size() - 1 - after];
  }
};

// A part of an event that changed the bone in another way than by a cut: leaves to set, and bodies to keep.
struct BonePart {
  RoomSeq seq;
  std::vector<BodyId> bodies;     // every other body is gone
  std::uint64_t lease_epoch = 0;  // cuts of an earlier one will be rejected
  std::vector<FieldLeaf> leaves;
  bool last = false;  // last part of the event
};

// An instructor has restricted the caller's hand: everything that is in force from now on.
struct HandSupervised {
  RoomSeq seq;  // 0: it was in force when the stream began
  Restrictions supervision;
  std::uint64_t lease_epoch = 0;  // of the caller's lease from now on; cuts of an earlier one will be rejected
  Decider by{};                   // as far as the room says it
};

// A message from a person in the room.
struct WordsSaid {
  RoomSeq seq;
  AuthorId from, to;  // to: null for all
  std::string words;
};

// Functions called with what is received, on the session's own thread, one after the other. The order is: the scene,
// every leaf, then `complete`, then events in room_seq order. One of these events may be reported both as a change and
// as a scene.
//
// When the connection breaks, `interrupted` is called. After reconnecting everything is repeated: the scene, every
// leaf, `complete`. Cuts that were sent and are undecided are sent again. `lost` is called at most once, as the last
// call, and never after close(). Tools are added to tools() before any event that names them.
struct RoomCallbacks {
  std::function<void(const FieldLeaf& leaf)> leaf{};
  std::function<void(const RoomAtJoin& room)> complete{};
  std::function<void(RoomSeq room_seq, const Cut& cut)> committed{};  // of anybody, including the caller
  // For the caller's cut. What the caller cut on top of it is dropped too. `lease_epoch` is that of the caller's lease
  // from now on.
  std::function<void(RoomSeq room_seq, std::uint64_t author_seq, std::uint64_t lease_epoch, const std::string& reason)>
      rejected{};
  std::function<void(BonePart&& part)> change{};
  std::function<void(RoomSeq room_seq, const std::vector<SceneItem>& items)> scene{};  // all items from now on
  // Called once with each `complete`, just before or after it, and at every change of restrictions.
  std::function<void(const HandSupervised& decided)> supervised{};
  std::function<void(const WordsSaid& said)> said{};
  // Newest state of a partner's tool; outside the order of events.
  std::function<void(const CuttingState& partner)> partner{};
  // Whether the newest datagram says that the caller's hand is stopped. Called when this has changed; its log entry may
  // arrive later. Ignore a flag that is older than the newest log entry (by its lease's epoch). Called from another
  // thread, at any time until close(); it must not wait.
  std::function<void(std::uint64_t lease_epoch, bool frozen)> stop_flag{};
  // Pose of the bone on its mount, in a room that has one: the newest, outside the order of events. Called from another
  // thread, one call at a time. Its numbers begin anew after `interrupted`. It must not wait.
  std::function<void(const MountPose& seen)> bone{};
  std::function<void(RoomSeq room_seq)> noted{};  // a tool was added, somebody joined, a mark was set
  std::function<void(const Error& why)> interrupted{};
  std::function<void(const Error& why)> lost{};  // for good: the room is over, or no longer knows this client
};

}  // namespace osteon
