#include "server/publish/session_messages.hpp"

#include "common/wire/bone_motion.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/encoded_cut.hpp"
#include "common/wire/version.hpp"

namespace osteon {
namespace {

// Events that changed the bone by other means than cuts are sent as leaves. This is the approximate size of one
// message.
constexpr std::size_t kChangeBytes = 128 * 1024;

v1::BoneChangeKind wire_kind(EventKind kind) {
  switch (kind) {
    case EventKind::split:
      return v1::BONE_CHANGE_KIND_SPLIT;
    case EventKind::undo:
      return v1::BONE_CHANGE_KIND_UNDO;
    case EventKind::redo:
      return v1::BONE_CHANGE_KIND_REDO;
    case EventKind::remove_body:
      return v1::BONE_CHANGE_KIND_REMOVE_BODY;
    default:
      return v1::BONE_CHANGE_KIND_UNSPECIFIED;
  }
}

// Serialises the message. It gets its place in the room's order, and the right that its receiver needs.
SessionMessage message_of(const v1::SessionResponse& response, RoomSeq seq = {},
                          std::optional<StreamContent> content = {}) {
  return {seq, serialised(response), content, wire::version_of(response.message_case()), {.room_seq = seq}};
}

}  // namespace

Bytes block_message(const BlockKey& key, const StoredBlock& block) {
  v1::WatchMeshResponse response;
  v1::MeshBlock& out = *response.add_blocks();
  out.set_body(key.body.value);
  out.set_level(key.level);
  *out.mutable_index() = wire::to_wire(key.index);
  out.set_version(block.version);
  out.set_payload(block.payload.bytes.data(), block.payload.bytes.size());
  out.set_mesh_hash(wire::to_wire(block.mesh_hash));
  return serialised(response);
}

Bytes complete_message(const SessionStart& start, const std::vector<RoomSeq>& decided) {
  v1::SessionResponse response;
  v1::FieldComplete& complete = *response.mutable_complete();
  complete.set_room_seq(start.contained.value);
  complete.set_lease_epoch(start.lease_epoch);
  complete.set_decided_author_seq(start.decided_author_seq);
  for (const RoomSeq seq : decided) complete.add_decided_room_seqs(seq.value);
  for (const BodyId body : start.bodies) complete.add_bodies(body.value);
  return serialised(response);
}

SessionMessage cut_message(RoomSeq seq, const Cut& cut, std::string_view encoded) {
  v1::CommittedCut head;
  head.set_room_seq(seq.value);
  std::string committed = head.SerializeAsString(), response;
  wire::append_field(committed, v1::CommittedCut::kCutFieldNumber, encoded);
  wire::append_field(response, v1::SessionResponse::kCommittedFieldNumber, committed);
  return {seq,
          std::make_shared<const std::string>(std::move(response)),
          StreamContent::field,
          wire::version_of(v1::SessionResponse::kCommitted),
          {.room_seq = seq, .kind = wire::SessionEntryKind::committed, .cut = cut}};
}

SessionMessage rejection_message(RoomSeq seq, std::uint64_t author_seq, std::uint64_t lease_epoch, Rejection reason) {
  v1::SessionResponse response;
  v1::RejectedCut& entry = *response.mutable_rejected();
  entry.set_room_seq(seq.value);
  entry.set_author_seq(author_seq);
  entry.set_lease_epoch(lease_epoch);
  entry.set_reason(std::string(sentence(reason)));
  entry.set_code(wire::to_wire(reason));
  SessionMessage message = message_of(response, seq);
  message.fast.kind = wire::SessionEntryKind::rejected;
  message.fast.author_seq = author_seq;
  message.fast.reason = static_cast<std::uint32_t>(reason);
  message.fast.lease_epoch = lease_epoch;
  return message;
}

SessionMessage link_message(const SessionKeys& keys, std::uint16_t udp_port) {
  v1::SessionResponse response;
  v1::LinkOffer& offer = *response.mutable_link();
  offer.set_session(keys.session);
  offer.set_key_up(keys.up.bytes.data(), keys.up.bytes.size());
  offer.set_key_down(keys.down.bytes.data(), keys.down.bytes.size());
  offer.set_udp_port(udp_port);
  return message_of(response);
}

SessionMessage durable_message(const Witness& witness) {
  v1::SessionResponse response;
  response.mutable_durable()->set_room_seq(witness.head.seq.value);
  response.mutable_durable()->set_chain(wire::to_wire(witness.head.chain));
  response.mutable_durable()->set_seal(wire::to_wire(witness.seal));
  return message_of(response);
}

SessionMessage redial_message(std::chrono::milliseconds after, const std::string& why) {
  v1::SessionResponse response;
  response.mutable_redial()->set_after_ms(static_cast<std::uint32_t>(after.count()));
  response.mutable_redial()->set_why(why);
  return message_of(response);
}

SessionMessage tool_message(RoomSeq seq, const Tool& tool, std::uint32_t number) {
  v1::SessionResponse response;
  response.mutable_tool()->set_room_seq(seq.value);
  *response.mutable_tool()->mutable_tool() = wire::to_wire(tool);
  response.mutable_tool()->set_tool_number(number);
  return message_of(response, seq);
}

SessionMessage scene_message(RoomSeq seq, const std::vector<SceneItem>& items) {
  v1::SessionResponse response;
  response.mutable_scene()->set_room_seq(seq.value);
  for (const SceneItem& item : items) *response.mutable_scene()->add_items() = wire::to_wire(item);
  return message_of(response, seq, StreamContent::scene);
}

SessionMessage supervised_message(RoomSeq seq, const Restrictions& supervision, std::uint64_t lease_epoch,
                                  const Decider& by) {
  v1::SessionResponse response;
  response.mutable_supervised()->set_room_seq(seq.value);
  *response.mutable_supervised()->mutable_supervision() = wire::to_wire(supervision);
  response.mutable_supervised()->set_lease_epoch(lease_epoch);
  response.mutable_supervised()->set_decided_by(by.author.value);
  response.mutable_supervised()->set_decided_by_name(by.name);
  SessionMessage message = message_of(response, seq, StreamContent::own_supervision);
  message.fast.kind = wire::SessionEntryKind::supervised;
  message.fast.lease_epoch = lease_epoch;
  message.fast.supervision = supervision;
  message.fast.by = by;
  return message;
}

SessionMessage said_message(RoomSeq seq, AuthorId from, const WordsEntry& words) {
  v1::SessionResponse response;
  response.mutable_chat()->set_room_seq(seq.value);
  response.mutable_chat()->set_from(from.value);
  response.mutable_chat()->set_to(words.to.value);
  response.mutable_chat()->set_words(words.words);
  return message_of(response, seq, StreamContent::own_words);
}

SessionMessage partner_message(const CuttingState& state) {
  v1::SessionResponse response;
  *response.mutable_partner() = wire::to_wire(state);
  return message_of(response);
}

SessionMessage bone_message(const MountPose& seen) {
  v1::SessionResponse response;
  *response.mutable_bone() = wire::to_wire(seen);
  return message_of(response);
}

SessionMessage noted_message(RoomSeq seq, const std::string& mark) {
  v1::SessionResponse response;
  response.mutable_noted()->set_room_seq(seq.value);
  response.mutable_noted()->set_mark(mark);
  return message_of(response, seq);
}

Bytes field_entry(const SessionMessage& message, bool may_receive_field) {
  const bool whole = !message.content || (*message.content == StreamContent::field && may_receive_field);
  return whole ? message.bytes : noted_message(message.seq, {}).bytes;
}

std::vector<SessionMessage> change_messages(const RoomEvent& event) {
  std::vector<SessionMessage> messages;
  std::size_t next = 0;
  do {
    v1::SessionResponse response;
    v1::BoneChange& change = *response.mutable_change();
    change.set_room_seq(event.room_seq.value);
    change.set_kind(wire_kind(event.kind));
    change.set_author(event.author.value);
    change.set_lease_epoch(event.lease_epoch);
    for (const BodyId body : event.bodies) change.add_bodies(body.value);
    for (std::size_t size = 0; next < event.leaves.size() && size < kChangeBytes; ++next) {
      v1::FieldLeaf& leaf = *change.add_leaves();
      leaf = wire::to_wire(event.leaves[next]);
      size += leaf.values().size() + 24;
    }
    change.set_last(next == event.leaves.size());
    messages.push_back(message_of(response, event.room_seq, StreamContent::field));
  } while (next < event.leaves.size());
  return messages;
}

}  // namespace osteon
