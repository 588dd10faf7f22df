#include "server/publish/send_queue.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/wire/convert.hpp"

namespace osteon {
namespace {

std::size_t bytes_of(const FieldLeaf& leaf) { return leaf.values.size() * sizeof(leaf.values[0]); }

}  // namespace

Bytes serialised(const google::protobuf::MessageLite& message) {
  return std::make_shared<const std::string>(message.SerializeAsString());
}

MeshSendQueue::MeshSendQueue(MeshUpdate snapshot)
    : waiting_(std::move(snapshot.blocks)),
      snapshot_blocks_(waiting_.size()),
      snapshot_seq_(snapshot.room_seq),
      newest_(snapshot.room_seq) {}

void MeshSendQueue::add(const MeshUpdate& update) {
  for (const auto& [key, bytes] : update.blocks) waiting_.insert_or_assign(key, bytes);
  newest_ = update.room_seq;
  news_ = true;
}

MessageParts MeshSendQueue::take() {
  if (waiting_.empty() && !news_) return {};
  MessageParts parts;
  std::size_t size = 0;
  bool wrapped = waiting_.empty();
  while (!waiting_.empty()) {
    auto next = started_ ? waiting_.upper_bound(cursor_) : waiting_.begin();
    if (next == waiting_.end()) {
      wrapped = true;
      next = waiting_.begin();
    }
    if (!parts.empty() && size + next->second->size() > kMessageBytes) break;
    size += next->second->size();
    cursor_ = next->first;
    started_ = true;
    parts.push_back(std::move(next->second));
    waiting_.erase(next);
  }

  // The first round has sent every block of the first surface, each at least as new as that surface.
  if (!snapshot_sent_ && (wrapped || waiting_.empty())) {
    snapshot_sent_ = true;
    said_ = snapshot_seq_;
  }
  if (waiting_.empty()) {
    said_ = newest_;
    news_ = false;
  }
  v1::WatchMeshResponse head;
  head.set_room_seq(said_.value);
  head.set_snapshot_complete(snapshot_sent_);
  head.set_snapshot_blocks(static_cast<std::uint32_t>(snapshot_blocks_));
  parts.push_back(serialised(head));
  return parts;
}

void SessionSendQueue::begin(RoomSeq contained, MessageParts before, Bytes complete, std::size_t leaf_bytes) {
  leaf_bytes_ = leaf_bytes;
  contained_ = contained;
  before_.assign(std::make_move_iterator(before.begin()), std::make_move_iterator(before.end()));
  complete_ = std::move(complete);
}

void SessionSendQueue::set_leaves(std::vector<FieldLeaf> leaves) {
  leaves_ = std::move(leaves);
  leaves_known_ = true;
  leaf_bytes_ = 0;
  for (const FieldLeaf& leaf : leaves_) leaf_bytes_ += bytes_of(leaf);
}

bool SessionSendQueue::add(RoomSeq seq, Bytes entry) {
  if (!takes(seq)) return true;
  if (!has_space(entry)) return false;
  put(++index_, std::move(entry));
  seqs_.emplace_back(index_, seq);
  if (seqs_.size() > kMaxEntries) seqs_.pop_front();
  return true;
}

bool SessionSendQueue::add_answer(Bytes entry) {
  if (!has_space(entry)) return false;
  put(0, std::move(entry));
  return true;
}

bool SessionSendQueue::has_space(const Bytes& entry) const {
  return entries_.size() < kMaxEntries && entry->size() <= most_entry_bytes_ - entry_bytes_;
}

void SessionSendQueue::put(std::uint64_t index, Bytes entry) {
  entry_bytes_ += entry->size();
  entries_.push_back({index, std::move(entry)});
}

RoomSeq SessionSendQueue::arrived(std::uint64_t index) {
  std::erase_if(entries_, [&](const Entry& entry) {
    const bool has = entry.index != 0 && entry.index <= index;
    if (has) entry_bytes_ -= entry.bytes->size();
    return has;
  });
  RoomSeq newest;
  for (; !seqs_.empty() && seqs_.front().first <= index; seqs_.pop_front()) newest = seqs_.front().second;
  return newest;
}

MessageParts SessionSendQueue::take() {
  // Until then some of it may not be durable.
  if (!leaves_known_) return {};
  if (!before_.empty()) {
    MessageParts parts{std::move(before_.front())};
    before_.pop_front();
    return parts;
  }
  v1::SessionResponse response;
  if (next_leaf_ < leaves_.size()) {
    *response.mutable_leaf() = wire::to_wire(leaves_[next_leaf_]);
    // Each leaf's memory is freed when it is sent; the list itself with the last leaf.
    leaf_bytes_ -= bytes_of(leaves_[next_leaf_]);
    leaves_[next_leaf_].values = {};
    if (++next_leaf_ == leaves_.size()) {
      leaves_ = {};
      next_leaf_ = 0;
    }
    return {serialised(response)};
  }
  if (complete_) return {std::exchange(complete_, nullptr)};
  if (entries_.empty()) return {};
  const Entry entry = std::move(entries_.front());
  entries_.pop_front();
  entry_bytes_ -= entry.bytes->size();
  if (entry.index == 0) return {entry.bytes};
  // All streams share the entry. Its index is appended, as protobuf merges messages.
  v1::SessionResponse number;
  number.set_index(entry.index);
  return {entry.bytes, serialised(number)};
}

void PartnerSendQueue::enqueue(const std::vector<CuttingState>& all, bool by_stream) {
  std::erase_if(partners_, [&](const auto& known) {
    return std::ranges::find(all, known.first, &CuttingState::author) == all.end();
  });
  for (const CuttingState& state : all) {
    const auto known = partners_.find(state.author);
    if (known == partners_.end()) {
      if (partners_.size() < kMost) partners_[state.author] = {state, by_stream};
      continue;
    }
    Partner& partner = known->second;
    partner.waits = by_stream && (partner.waits || partner.state.state_seq != state.state_seq);
    partner.state = state;
  }
}

std::optional<CuttingState> PartnerSendQueue::take(Clock::time_point now) {
  for (auto& [author, partner] : partners_) {
    if (!partner.waits || now < partner.next) continue;
    partner.waits = false;
    partner.next = now + kApart;
    return partner.state;
  }
  return std::nullopt;
}

bool PartnerSendQueue::waits() const {
  return std::ranges::any_of(partners_, [](const auto& entry) { return entry.second.waits; });
}

}  // namespace osteon
