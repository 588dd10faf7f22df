#include "haptic_client/net/session_reader.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "common/field/rejection.hpp"
#include "common/wire/bone_motion.hpp"
#include "common/wire/convert.hpp"

namespace osteon {
namespace {

std::vector<BodyId> bodies_of(const google::protobuf::RepeatedField<std::uint32_t>& ids) {
  std::vector<BodyId> bodies;
  for (const std::uint32_t id : ids) bodies.push_back(BodyId{id});
  return bodies;
}

// Datagrams carry the number alone.
std::string sentence_of(Rejection reason) {
  if (reason == Rejection::none) return "for a reason that this version does not know";
  return std::string(sentence(reason));
}

}  // namespace

SessionReader::SessionReader(AuthorId own, std::shared_ptr<ToolBox> tools, RoomCallbacks callbacks,
                             std::function<void(std::uint64_t)> decided, std::function<void(std::uint64_t)> complete)
    : own_(own),
      tools_(std::move(tools)),
      callbacks_(std::move(callbacks)),
      decided_(std::move(decided)),
      complete_(std::move(complete)) {}

void SessionReader::begin() {
  entries_ = ReceiveWindow<Entry>(1, kMostAhead);
  fault_.reset();
  seq_ = {};
  supervised_ = false;
  partners_.clear();
}

Result<void> SessionReader::take(v1::SessionResponse response) {
  if (fault_) return tl::unexpected(*fault_);
  // An answer outside the order: its event is in the leaves, or was received before.
  if (response.index() == 0 && response.has_committed())
    return decided_(response.committed().cut().author_seq()), Result<void>{};
  if (response.index() == 0 && response.has_rejected())
    return decided_(response.rejected().author_seq()), Result<void>{};
  if (response.index() == 0) return remember(deliver(response));
  const std::uint64_t index = response.index();
  entries_.insert(index, std::move(response));
  return pass_on();
}

Result<void> SessionReader::take(wire::IndexedEntry entry) {
  if (fault_) return tl::unexpected(*fault_);
  // The stream sends what such an entry stands for.
  if (entry.entry.kind == wire::SessionEntryKind::streamed) return {};
  entries_.insert(entry.index, std::move(entry.entry));
  return pass_on();
}

Result<void> SessionReader::pass_on() {
  while (const std::optional<Entry> entry = entries_.take())
    if (Result<void> delivered = std::visit([&](const auto& one) { return deliver(one); }, *entry); !delivered)
      return remember(std::move(delivered));
  return {};
}

Result<void> SessionReader::remember(Result<void> delivered) {
  if (!delivered) fault_ = delivered.error();
  return delivered;
}

bool SessionReader::cuts(const Cut& cut) const {
  const ToolBox::Entry* tool = tools_->find(cut.tool);
  return tool && tool->body.cuts();
}

void SessionReader::take(const CuttingState& partner) {
  // The newer state counts, whichever way it arrives.
  std::uint64_t& newest = partners_[partner.author];
  if (partner.author == own_ || partner.state_seq <= newest) return;
  newest = partner.state_seq;
  if (callbacks_.partner) callbacks_.partner(partner);
}

void SessionReader::pass(RoomMessage&& message) {
  if (callbacks_.message) callbacks_.message(std::move(message));
}

void SessionReader::supervised(const HandSupervised& decided) {
  seq_ = std::max(seq_, decided.seq);
  supervised_ = true;
  pass({decided});
}

Result<void> SessionReader::committed(RoomSeq seq, const Cut& cut) {
  // The room sends a tool before the first cut with it.
  if (!cuts(cut)) return failure(ErrorCode::invalid_input, "committed.cut names a tool that was not sent");
  seq_ = std::max(seq_, seq);
  if (cut.author == own_) decided_(cut.author_seq);
  pass({CutCommitted{seq, cut}});
  return {};
}

void SessionReader::rejected(const CutRejected& rejected) {
  seq_ = std::max(seq_, rejected.seq);
  decided_(rejected.author_seq);
  pass({rejected});
}

Result<void> SessionReader::deliver(const wire::SessionEntry& entry) {
  if (entry.kind == wire::SessionEntryKind::committed) return committed(entry.room_seq, entry.cut);
  if (entry.kind == wire::SessionEntryKind::supervised)
    supervised({entry.room_seq, entry.supervision, entry.lease_epoch, entry.by});
  else
    rejected({entry.room_seq, entry.author_seq, entry.lease_epoch, rejection_of(entry.reason),
              sentence_of(rejection_of(entry.reason))});
  return {};
}

Result<void> SessionReader::deliver(const v1::SessionResponse& response) {
  switch (response.message_case()) {
    case v1::SessionResponse::kLeaf: {
      Result<FieldLeaf> leaf = wire::from_wire(response.leaf());
      if (!leaf) return tl::unexpected(leaf.error());
      pass({std::move(*leaf)});
      return {};
    }
    case v1::SessionResponse::kComplete: {
      const v1::FieldComplete& entry = response.complete();
      complete_(entry.decided_author_seq());
      RoomAtJoin room{RoomSeq{entry.room_seq()}, bodies_of(entry.bodies()), entry.lease_epoch(),
                      entry.decided_author_seq()};
      for (const std::uint64_t seq : entry.decided_room_seqs()) room.decided_seqs.push_back(RoomSeq{seq});
      pass({std::move(room)});
      seq_ = std::max(seq_, RoomSeq{entry.room_seq()});
      // Nothing was sent about this hand: the restrictions of an earlier stream are over.
      if (!supervised_) supervised({RoomSeq{}, {}, entry.lease_epoch(), {}});
      return {};
    }
    case v1::SessionResponse::kTool: {
      const Result<Tool> tool = wire::from_wire(response.tool().tool());
      if (!tool) return tl::unexpected(tool.error());
      tools_->add(*tool);
      seq_ = std::max(seq_, RoomSeq{response.tool().room_seq()});
      if (response.tool().room_seq() != 0) pass({EventNoted{RoomSeq{response.tool().room_seq()}}});
      return {};
    }
    case v1::SessionResponse::kChange: {
      const v1::BoneChange& entry = response.change();
      BonePart part{RoomSeq{entry.room_seq()}, bodies_of(entry.bodies()), entry.lease_epoch(), {}, entry.last()};
      for (const v1::FieldLeaf& wire_leaf : entry.leaves()) {
        Result<FieldLeaf> leaf = wire::from_wire(wire_leaf);
        if (!leaf) return tl::unexpected(leaf.error());
        if (std::ranges::find(part.bodies, leaf->body) == part.bodies.end())
          return failure(ErrorCode::invalid_input, "change.leaves has one of a body that is gone");
        part.leaves.push_back(std::move(*leaf));
      }
      seq_ = std::max(seq_, part.seq);
      pass({std::move(part)});
      return {};
    }
    case v1::SessionResponse::kScene: {
      std::vector<SceneItem> items;
      for (const v1::SceneItem& wire_item : response.scene().items()) {
        const Result<SceneItem> item = wire::from_wire(wire_item);
        if (!item) return tl::unexpected(item.error());
        if (!tools_->find(item->tool))
          return failure(ErrorCode::invalid_input, "scene.items names a tool that was not sent");
        items.push_back(*item);
      }
      // Without an index it precedes the leaves, which have not arrived.
      if (response.index() != 0) seq_ = std::max(seq_, RoomSeq{response.scene().room_seq()});
      pass({SceneSet{RoomSeq{response.scene().room_seq()}, std::move(items)}});
      return {};
    }
    case v1::SessionResponse::kCommitted: {
      const Result<Cut> cut = wire::from_wire(response.committed().cut());
      if (!cut) return tl::unexpected(cut.error());
      return committed(RoomSeq{response.committed().room_seq()}, *cut);
    }
    case v1::SessionResponse::kRejected: {
      const v1::RejectedCut& entry = response.rejected();
      rejected({RoomSeq{entry.room_seq()}, entry.author_seq(), entry.lease_epoch(), wire::from_wire(entry.code()),
                entry.reason()});
      return {};
    }
    case v1::SessionResponse::kDurable: {
      const Result<Digest> chain = wire::digest_from_wire(response.durable().chain());
      if (!chain) return tl::unexpected(chain.error());
      // An older server sends no seal.
      const Result<Digest> seal = wire::digest_from_wire(response.durable().seal());
      kept_ = {RoomSeq{response.durable().room_seq()}, *chain, seal ? *seal : Digest{}};
      return {};
    }
    case v1::SessionResponse::kNoted:
      seq_ = std::max(seq_, RoomSeq{response.noted().room_seq()});
      pass({EventNoted{RoomSeq{response.noted().room_seq()}}});
      return {};
    case v1::SessionResponse::kSupervised: {
      const v1::Supervised& entry = response.supervised();
      const Result<Restrictions> supervision = wire::from_wire(entry.supervision());
      if (!supervision) return tl::unexpected(supervision.error());
      supervised({RoomSeq{entry.room_seq()},
                  *supervision,
                  entry.lease_epoch(),
                  {AuthorId{entry.decided_by()}, entry.decided_by_name()}});
      return {};
    }
    case v1::SessionResponse::kChat: {
      const v1::ChatMessage& entry = response.chat();
      seq_ = std::max(seq_, RoomSeq{entry.room_seq()});
      pass({ChatReceived{RoomSeq{entry.room_seq()}, AuthorId{entry.from()}, AuthorId{entry.to()}, entry.words()}});
      return {};
    }
    case v1::SessionResponse::kPartner: {
      const Result<CuttingState> partner = wire::from_wire(response.partner());
      if (!partner) return tl::unexpected(partner.error());
      take(*partner);
      return {};
    }
    case v1::SessionResponse::kBone: {
      const Result<MountPose> seen = wire::from_wire(response.bone());
      if (!seen) return tl::unexpected(seen.error());
      if (callbacks_.bone) callbacks_.bone(*seen);
      return {};
    }
    case v1::SessionResponse::kLink:
    case v1::SessionResponse::kRedial:
      return {};  // the session's own
    default:
      return failure(ErrorCode::unsupported, "SessionResponse.message is not known to this client");
  }
}

}  // namespace osteon
