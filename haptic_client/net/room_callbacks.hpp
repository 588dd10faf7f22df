// What a room tells a haptic client.
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

// Where a room stands when all leaves were sent: they contain every event up to this place.
struct RoomAtJoin {
  RoomSeq contained;
  std::vector<BodyId> bodies;
  std::uint64_t lease_epoch = 0;
  std::uint64_t decided_author_seq =
      0;  // the caller's cuts up to this one were decided: they are in the leaves or rejected
  std::vector<RoomSeq> decided_places{};  // of the newest of these, the last that of decided_author_seq; null: rejected
  // Of one of these cuts; nothing: the room does not say it.
  [[nodiscard]] std::optional<RoomSeq> place_of(std::uint64_t author_seq) const {
    const std::uint64_t after = decided_author_seq - author_seq;
    if (author_seq == 0 || author_seq > decided_author_seq || after >= decided_places.size()) return std::nullopt;
    return decided_places[decided_places.size() - 1 - after];
  }
};

// A part of an event that changed the bone otherwise than by a cut: leaves to set, of bodies to hold.
struct BonePart {
  RoomSeq place;
  std::vector<BodyId> bodies;     // any other is gone
  std::uint64_t lease_epoch = 0;  // cuts of an earlier one will be rejected
  std::vector<FieldLeaf> leaves;
  bool last = false;  // part of the event
};

// An instructor has decided about the caller's hand: all that holds from now on.
struct HandSupervised {
  RoomSeq place;  // 0: it held when the stream began
  Restrictions supervision;
  std::uint64_t lease_epoch = 0;  // of the caller's lease from now on; cuts of an earlier one will be rejected
  Decider by{};                   // as far as the room says it
};

// Words of somebody in the room.
struct WordsSaid {
  RoomSeq place;
  AuthorId from, to;  // to: null for all
  std::string words;
};

// What comes down. Called on the session's own thread, one after the other: the scene, every leaf, then `complete`,
// then events in room_seq order; one may come as a change and as a scene. When the line breaks, `interrupted`, and once
// it is made again, all of that anew: the scene, every leaf, `complete`, and cuts that were sent and not decided are
// sent again. `lost` comes at most once and last, and never after close(). Tools go to tools() before anything that
// names them.
struct RoomCallbacks {
  std::function<void(const FieldLeaf& leaf)> leaf{};
  std::function<void(const RoomAtJoin& room)> complete{};
  std::function<void(RoomSeq place, const Cut& cut)> committed{};  // of anyone, the caller's own included
  // The caller's; what he cut on top of it falls too, and `lease_epoch` is that of his lease from now on.
  std::function<void(RoomSeq place, std::uint64_t author_seq, std::uint64_t lease_epoch, const std::string& reason)>
      rejected{};
  std::function<void(BonePart&& part)> change{};
  std::function<void(RoomSeq place, const std::vector<SceneItem>& items)> scene{};  // all that stand from now on
  // Once with each `complete`, just before or after it, and whenever something is decided.
  std::function<void(const HandSupervised& decided)> supervised{};
  std::function<void(const WordsSaid& said)> said{};
  std::function<void(const CuttingState& partner)> partner{};  // newest state of another's tool; outside the order
  // The newest datagram's word on whether the caller's hand is stopped, where it has changed; its entry may come later.
  // Of one that is older than the newest entry (by its lease's epoch) nothing holds. Called from another thread, at any
  // time until close(): it may not wait.
  std::function<void(std::uint64_t lease_epoch, bool frozen)> stop_flag{};
  // Where the bone stands on its mount, of a room that has one: newest, outside the order, from another thread, one at
  // a time. Numbers begin anew after `interrupted`. It may not wait.
  std::function<void(const MountPose& seen)> bone{};
  std::function<void(RoomSeq place)> noted{};  // a tool was added, somebody came, a mark was set
  std::function<void(const Error& why)> interrupted{};
  std::function<void(const Error& why)> lost{};  // for good: the room is over, or knows this client no more
};

}  // namespace osteon
