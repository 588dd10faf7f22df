// Serialises a room's events as messages to its members: each once, shared by all streams.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/access/role_table.hpp"
#include "common/link/sealed.hpp"
#include "common/mechanics/compliant_mount.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/wire/cut_run.hpp"
#include "server/journal/chain.hpp"
#include "server/publish/send_queue.hpp"
#include "server/room/room.hpp"

namespace osteon {

// A whole WatchMeshResponse.
[[nodiscard]] Bytes block_message(const BlockKey& key, const StoredBlock& block);

// A message to a session, with what decides who receives it. So nobody parses the bytes again.
struct SessionMessage {
  RoomSeq seq;                             // of an event; null: outside the room's order
  Bytes bytes;                             // a whole SessionResponse
  std::optional<StreamContent> content{};  // what a role must be allowed to receive; nothing: every role receives it
  std::uint32_t since_version = 0;         // the oldest version of the protocol that knows the message
  wire::SessionEntry fast{};               // the short form for the fast path; `streamed`: there is none
};

// What a reader of the field is sent for it, a whole WatchFieldResponse: the same bytes if they are about the field and
// `may_receive_field`, else that there was an event.
[[nodiscard]] Bytes field_entry(const SessionMessage& message, bool may_receive_field);

// What a session begins with.
struct SessionStart {
  RoomSeq contained;                     // the sequence number that the leaves contain
  std::uint64_t decided_author_seq = 0;  // the newest decided cut of the session's author
  std::uint64_t lease_epoch = 0;         // of the session's author
  std::vector<BodyId> bodies;
  std::vector<SessionMessage> before;  // sent before the leaves
  std::size_t leaf_bytes = 0;          // of the leaves that follow, at most
  Bytes complete;                      // the message that ends the leaves; a whole SessionResponse
};

// The message that ends the leaves. `decided`: sequence numbers of the author's newest decided cuts; null: rejected.
[[nodiscard]] Bytes complete_message(const SessionStart& start, const std::vector<RoomSeq>& decided);

// `encoded`: the bytes of the cut, as wire::encoded makes them.
[[nodiscard]] SessionMessage cut_message(RoomSeq seq, const Cut& cut, std::string_view encoded);
[[nodiscard]] SessionMessage rejection_message(RoomSeq seq, std::uint64_t author_seq, std::uint64_t lease_epoch,
                                               Rejection reason);
[[nodiscard]] SessionMessage link_message(const SessionKeys& keys, std::uint16_t udp_port);
[[nodiscard]] SessionMessage durable_message(const Witness& witness);
[[nodiscard]] SessionMessage redial_message(std::chrono::milliseconds after, const std::string& why);
[[nodiscard]] SessionMessage tool_message(RoomSeq seq, const Tool& tool, std::uint32_t number);
[[nodiscard]] SessionMessage scene_message(RoomSeq seq, const std::vector<SceneItem>& items);
// What an instructor has decided. `seq` null: what was valid before. `by`: who decided it, as far as known.
[[nodiscard]] SessionMessage supervised_message(RoomSeq seq, const Restrictions& supervision, std::uint64_t lease_epoch,
                                                const Decider& by);
[[nodiscard]] SessionMessage said_message(RoomSeq seq, AuthorId from, const WordsEntry& words);
[[nodiscard]] SessionMessage partner_message(const CuttingState& state);
[[nodiscard]] SessionMessage bone_message(const MountPose& seen);
[[nodiscard]] SessionMessage noted_message(RoomSeq seq, const std::string& mark);
[[nodiscard]] std::vector<SessionMessage> change_messages(const RoomEvent& event);  // at least one; of bounded size

}  // namespace osteon
