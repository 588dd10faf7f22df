// What a haptic client receives from its room.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/field/field_hash.hpp"
#include "common/field/rejection.hpp"
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
struct ChatReceived {
  RoomSeq seq;
  AuthorId from, to;  // to: null for all
  std::string words;
};

// A cut of the caller that the room rejected. What the caller cut on top of it is dropped too.
struct CutRejected {
  RoomSeq seq;  // of the rejection
  std::uint64_t author_seq = 0;
  std::uint64_t lease_epoch = 0;       // of the caller's lease from now on
  Rejection reason = Rejection::none;  // none: a reason that this version does not know
  std::string sentence;                // the reason, for people
};

// A cut of anybody, including the caller.
struct CutCommitted {
  RoomSeq seq;
  Cut cut;
};

// All items of the scene from now on. `seq` as of the newest change.
struct SceneSet {
  RoomSeq seq;
  std::vector<SceneItem> items;
};

// An event that changes nothing here: a tool was added, somebody joined, a mark was set.
struct EventNoted {
  RoomSeq seq;
};

// The connection to the room is down and is being made again.
struct Interrupted {
  Error why;
};

// The order is: SceneSet, every FieldLeaf, then RoomAtJoin, then events in order of their sequence numbers. One of
// these events may be reported both as a BonePart and as a SceneSet. HandSupervised comes once with each RoomAtJoin,
// just before or after it, and at every change of restrictions. After Interrupted everything is repeated from the
// beginning, and cuts that were sent and are undecided are sent again.
using RoomMessage = std::variant<FieldLeaf, RoomAtJoin, CutCommitted, CutRejected, BonePart, SceneSet, HandSupervised,
                                 ChatReceived, EventNoted, Interrupted>;

// Functions called with what is received. `message`, `partner` and `lost` are called on the session's own thread, one
// after the other.
struct RoomCallbacks {
  // Everything that has an order. Tools are added to RoomSession::tools() before any message that names them.
  std::function<void(RoomMessage&& message)> message{};
  // Newest state of a partner's tool; outside the order of messages.
  std::function<void(const CuttingState& partner)> partner{};
  // Whether the newest datagram says that the caller's hand is stopped. Called when this has changed; its log entry may
  // arrive later. Ignore a flag that is older than the newest log entry (by its lease's epoch). Called from another
  // thread, at any time until close(); it must not wait.
  std::function<void(std::uint64_t lease_epoch, bool frozen)> stop_flag{};
  // Pose of the bone on its mount, in a room that has one: the newest, outside the order of messages. Called from
  // another thread, one call at a time. Its numbers begin anew after Interrupted. It must not wait.
  std::function<void(const MountPose& seen)> bone{};
  // For good: the room is over, or no longer knows this client. At most once, as the last call, never after close().
  std::function<void(const Error& why)> lost{};
};

}  // namespace osteon
