#include "common/wire/server_link.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/core/check.hpp"

namespace osteon::wire {
namespace {

using namespace std::chrono_literals;
using Time = LinkEndpoint::Time;

constexpr Time kPartnerRefresh = 250ms;  // repeats a resting tool's state, which may have been lost

}  // namespace

ServerLink::ServerLink(const SessionKeys& keys, AuthorId author, FillRandom random, std::uint64_t first_author_seq,
                       std::uint64_t first_index, const LinkOptions& options)
    : endpoint_(keys.session, keys.down, keys.up, first_index, options),
      author_(author),
      path_(std::move(random), options.path),
      cuts_(first_author_seq, options.most_ahead),
      decided_(first_author_seq - 1),
      sender_(endpoint_.window(), tools_) {}

void ServerLink::receive(const Endpoint& from, std::span<const std::uint8_t> datagram, Time now) {
  DatagramBuffer plain;
  const auto opened = endpoint_.open(datagram, now, plain);
  if (!opened) return;
  // Everything is parsed before anything is used.
  v1::UpPacket packet;
  if (!packet.ParseFromArray(opened->plain.data(), static_cast<int>(opened->plain.size())))
    return endpoint_.malformed();
  PathToken token{};
  const std::string& echo = packet.path_echo();
  if (!echo.empty() && echo.size() != token.size()) return endpoint_.malformed();
  std::ranges::copy(echo, token.begin());
  std::vector<Cut> cuts;
  std::uint64_t left_out = 0;
  for (const v1::CutRun& run : packet.cuts()) {
    auto read = cuts_of(run, author_, tools_);
    if (!read && read.error().code != ErrorCode::not_found) return endpoint_.malformed();
    if (!read)
      ++left_out;
    else
      std::ranges::move(*read, std::back_inserter(cuts));
  }
  if (!std::ranges::all_of(cuts, [](const Cut& cut) { return fits_a_packet(cut); })) return endpoint_.malformed();
  KnownToolState state = state_;
  const auto newer = packet.has_state() ? take_over(packet.state(), state) : false;
  if (!newer) return endpoint_.malformed();
  std::optional<MountLoad> push;
  if (packet.has_push()) {
    const auto read = from_wire(packet.push());
    if (!read) return endpoint_.malformed();
    push = *read;
  }

  endpoint_.left_out(left_out);
  path_.received(from, opened->newest, datagram.size(), now);
  if (!echo.empty()) path_.echoed(from, token, now);
  if (from == path_.address()) endpoint_.is_alive(now);
  endpoint_.read_times(packet, *opened, now);
  for (Cut& cut : cuts) {
    const std::uint64_t number = cut.author_seq;
    cuts_.insert(number, std::move(cut));
  }
  if (packet.cuts_size() > 0) endpoint_.answer();
  if (*newer) {
    state_ = std::move(state);
    state_.state.author = author_;
    state_is_new_ = true;
  }
  if (push && push->push_seq > push_seq_) {
    push_ = push;
    push_seq_ = push->push_seq;
  }
}

void ServerLink::decided(std::uint64_t author_seq) {
  if (author_seq <= decided_) return;
  cuts_.skip(author_seq);
  decided_ = author_seq;
  endpoint_.answer();
}

std::optional<KnownToolState> ServerLink::take_state() {
  if (!std::exchange(state_is_new_, false)) return {};
  return state_;
}

bool ServerLink::push(const IndexedEntry& entry) {
  if (endpoint_.begin(entry.index) && fits_a_packet(entry.entry) && sender_.push(entry.entry)) return true;
  endpoint_.goes_over_stream();
  return false;
}

bool ServerLink::enqueue(std::uint64_t index, const SessionEntry& entry) {
  if (entry.kind == SessionEntryKind::committed && entry.cut.author == author_) decided(entry.cut.author_seq);
  if (entry.kind == SessionEntryKind::rejected) {
    decided(entry.author_seq);
    set_lease_epoch(entry.lease_epoch);
  }
  if (entry.kind == SessionEntryKind::supervised) {
    set_lease_epoch(entry.lease_epoch);
    set_frozen(!entry.supervision.may_cut());
  }
  return index != 0 && push({index, entry});
}

void ServerLink::set_partners(std::span<const KnownToolState> partners) {
  std::map<std::uint64_t, Partner> kept;
  for (const KnownToolState& state : partners.first(std::min(partners.size(), kMostPartners))) {
    const std::uint64_t author = state.state.author.value;
    const auto known = partners_.find(author);
    Partner& partner = kept[author] = known == partners_.end() ? Partner{} : std::move(known->second);
    partner.state = state;
  }
  partners_ = std::move(kept);
}

void ServerLink::set_lease_epoch(std::uint64_t epoch) {
  if (std::exchange(lease_epoch_, epoch) != epoch) endpoint_.repeat_news(endpoint_.rate().repeats());
}

void ServerLink::set_frozen(bool frozen) {
  if (std::exchange(frozen_, frozen) != frozen) endpoint_.repeat_news(endpoint_.rate().repeats());
}

Time ServerLink::due(const Partner& partner) const {
  const bool is_new = partner.state.state.state_seq > partner.said_seq;
  return partner.said_at + (is_new ? endpoint_.options().state_interval : kPartnerRefresh);
}

Time ServerLink::bone_due() const { return bone_ ? bone_at_ + endpoint_.options().bone_interval : Time::max(); }

Time ServerLink::next(Time now) const {
  if (!path_.address().is_set()) return Time::max();
  Time wanted = bone_due();
  for (const auto& [author, partner] : partners_) wanted = std::min(wanted, due(partner));
  return endpoint_.next(now, wanted);
}

std::optional<ServerLink::Out> ServerLink::challenge(Time now, std::span<std::uint8_t> into) {
  constexpr std::size_t kBytes = kSealBytes + 2 + sizeof(PathToken);
  const auto due = path_.challenge_due(kBytes, now);
  if (!due) return {};
  v1::DownPacket packet;
  packet.set_path_challenge(due->token.data(), due->token.size());
  const auto bytes = endpoint_.seal_beside(packet.SerializeAsString(), now, into);
  OSTEON_CHECK(bytes.size() == kBytes);
  return Out{due->to, bytes};
}

std::optional<ServerLink::Out> ServerLink::send(Time now, std::span<std::uint8_t> into) {
  if (auto out = challenge(now, into)) return out;
  if (next(now) > now) return {};
  PacketFiller<v1::DownPacket> filler(endpoint_.room(now));
  auto head = endpoint_.head<v1::DownPacket>(now, decided_, cuts_.beyond(decided_));
  head.set_lease_epoch(lease_epoch_);
  head.set_frozen(frozen_);
  const bool has_room = filler.add(head);
  OSTEON_CHECK(has_room);
  v1::DownPacket bone;
  if (bone_due() <= now) *bone.mutable_bone() = to_wire(*bone_);
  if (bone.has_bone() && bone.ByteSizeLong() + endpoint_.window().least_room(now) <= filler.room() &&
      filler.add(bone)) {
    bone_.reset();
    bone_at_ = now;
  }
  // Tools may take half of the room. Entries come next, repeated as far as they fit. Waiting tools get what is left.
  add_partners(filler, now, std::max(filler.room() / 2, endpoint_.window().least_room(now)));
  endpoint_.add_items(filler, now);
  add_partners(filler, now, 0);
  return Out{path_.address(), endpoint_.seal(filler.take(), now, into)};
}

void ServerLink::add_partners(PacketFiller<v1::DownPacket>& filler, Time now, std::size_t keep_free) {
  std::vector<Partner*> waiting;
  for (auto& [author, partner] : partners_)
    if (due(partner) <= now) waiting.push_back(&partner);
  std::ranges::sort(waiting, {}, [](const Partner* partner) { return partner->said_at; });
  for (Partner* partner : waiting) {
    const bool with_effort = now - partner->effort_at >= endpoint_.options().effort_interval;
    v1::DownPacket part;
    *part.add_partners() = to_tool_state(partner->state.state, partner->state.buttons, with_effort);
    if (part.ByteSizeLong() + keep_free > filler.room() || !filler.add(part)) continue;
    partner->said_seq = partner->state.state.state_seq;
    partner->said_at = now;
    if (with_effort) partner->effort_at = now;
  }
}

}  // namespace osteon::wire
