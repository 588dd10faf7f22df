#include "common/wire/client_link.hpp"

#include <algorithm>

#include "common/core/check.hpp"

namespace osteon::wire {
namespace {

using namespace std::chrono_literals;
using Time = LinkEndpoint::Time;

// Number of packets with the answer to one challenge. At 30 % loss, all of them are lost once in 15000 address changes.
constexpr int kEchoes = 8;
constexpr Time kPartnerForgotten = 2s;

bool at_the_bone(const KnownToolState& state) {
  return state.state.phase == CuttingPhase::cutting || state.state.phase == CuttingPhase::rubbing;
}

bool has_news(const KnownToolState& said, const KnownToolState& now, const PoseDeadband& band) {
  return has_moved(said.state.pose_bone_tool, now.state.pose_bone_tool, band) ||
         has_moved(said.state.pose_bone_device, now.state.pose_bone_device, band) || said.buttons != now.buttons ||
         said.state.phase != now.state.phase || said.state.on_metal != now.state.on_metal ||
         said.state.irrigation != now.state.irrigation || said.state.suction != now.state.suction ||
         said.state.blows != now.state.blows;
}

}  // namespace

ClientLink::ClientLink(const SessionKeys& keys, std::uint64_t first_author_seq, std::uint64_t first_index,
                       const LinkOptions& options)
    : endpoint_(keys.session, keys.up, keys.down, first_author_seq, options),
      arrived_(first_index, options.most_ahead) {}

bool ClientLink::push(const Cut& cut) {
  if (endpoint_.begin(cut.author_seq) && fits_a_packet(cut)) {
    if (!sender_ || cut.author_seq != coded_ + 1) sender_.emplace(endpoint_.window(), tools_);
    if (sender_->push(cut)) {
      coded_ = cut.author_seq;
      return true;
    }
  }
  endpoint_.goes_over_stream();
  return false;
}

void ClientLink::set_state(const CuttingState& state, std::uint32_t buttons) {
  state_ = {state, buttons};
  moved_ = !said_ || has_news(*said_, *state_, endpoint_.options().deadband);
}

void ClientLink::receive(std::span<const std::uint8_t> datagram, Time now) {
  DatagramBuffer plain;
  const auto opened = endpoint_.open(datagram, now, plain);
  if (!opened) return;
  // Everything is parsed before anything is used.
  v1::DownPacket packet;
  if (!packet.ParseFromArray(opened->plain.data(), static_cast<int>(opened->plain.size())))
    return endpoint_.malformed();
  const std::string& token = packet.path_challenge();
  if (!token.empty() && token.size() != echo_.size()) return endpoint_.malformed();
  std::size_t left_out = 0;
  const auto entries = entries_of(packet, tools_, &left_out);
  if (!entries) return endpoint_.malformed();
  if (std::ranges::any_of(*entries, [](const IndexedEntry& one) {
        return one.entry.kind != SessionEntryKind::streamed && !fits_a_packet(one.entry);
      }))
    return endpoint_.malformed();
  std::vector<KnownToolState> states;
  for (const v1::ToolState& sent : packet.partners()) {
    const auto known = partners_.find(sent.author());
    KnownToolState state = known == partners_.end() ? KnownToolState{} : known->second.state;
    const auto newer = take_over(sent, state);
    if (!newer) return endpoint_.malformed();
    if (*newer) states.push_back(std::move(state));
  }
  std::optional<MountPose> bone;
  if (packet.has_bone()) {
    const auto seen = from_wire(packet.bone());
    if (!seen) return endpoint_.malformed();
    bone = *seen;
  }

  endpoint_.left_out(left_out);
  if (!token.empty()) {
    std::ranges::copy(token, echo_.begin());
    echoes_left_ = kEchoes;
    endpoint_.repeat_news(kEchoes);
    return;  // a packet with a challenge goes to an unproven address and contains nothing else
  }
  endpoint_.is_alive(now);
  endpoint_.read_times(packet, *opened, now);
  // A later time than now was not sent by this client.
  if (packet.times().echo_sent_us() != 0 && packet.times().echo_sent_us() <= static_cast<std::uint64_t>(now / 1us))
    arrived_at_ = std::max(arrived_at_, Time(std::chrono::microseconds(packet.times().echo_sent_us())));
  if (opened->newest) {
    lease_epoch_ = packet.lease_epoch();
    frozen_ = packet.frozen();
  }
  for (const IndexedEntry& entry : *entries)
    if (entry.entry.kind != SessionEntryKind::streamed && note_arrival(entry.index)) entries_.push_back(entry);
  if (!entries->empty() || left_out > 0) endpoint_.answer();
  for (KnownToolState& state : states) keep_partner(std::move(state), now);
  if (bone && bone->seen_seq > bone_seq_) {
    bone_ = bone;
    bone_seq_ = bone->seen_seq;
  }
}

bool ClientLink::note_arrival(std::uint64_t index) {
  const bool is_new = arrived_.insert(index, {});
  while (arrived_.take()) {
  }
  return is_new;
}

void ClientLink::keep_partner(KnownToolState state, Time now) {
  const std::uint64_t author = state.state.author.value;
  if (partners_.size() == kMostPartners && !partners_.contains(author))
    partners_.erase(
        std::ranges::min_element(partners_, {}, [](const auto& entry) { return entry.second.received_at; }));
  partners_[author] = {std::move(state), now};
}

std::vector<KnownToolState> ClientLink::partners(Time now) const {
  std::vector<KnownToolState> states;
  for (const auto& [author, partner] : partners_)
    if (now - partner.received_at < kPartnerForgotten) states.push_back(partner.state);
  return states;
}

std::optional<IndexedEntry> ClientLink::take_entry() {
  if (entries_.empty()) return {};
  IndexedEntry entry = std::move(entries_.front());
  entries_.pop_front();
  return entry;
}

// When the state itself needs a packet.
Time ClientLink::state_due() const {
  if (moved_) return said_at_ + endpoint_.options().state_interval;
  return state_ && at_the_bone(*state_) ? effort_at_ + effort_interval() : Time::max();
}

// At the bone each state has its effort. The sound computes ahead from pairs of states, whose forces must be as new as
// their times.
Time ClientLink::effort_interval() const {
  const LinkOptions& options = endpoint_.options();
  return state_ && at_the_bone(*state_) ? std::min(options.effort_interval, options.state_interval)
                                        : options.effort_interval;
}

Time ClientLink::push_due() const { return push_ ? pushed_at_ + endpoint_.options().bone_interval : Time::max(); }

// The tool's state for the packet that goes now. Empty if there is nothing new.
v1::UpPacket ClientLink::state_part(Time now) const {
  v1::UpPacket part;
  const Time interval = effort_interval();
  if (state_ && (state_due() <= now || now - said_at_ >= interval))
    *part.mutable_state() = to_tool_state(state_->state, state_->buttons,
                                          now - effort_at_ >= interval || state_->state.tool_name != effort_tool_);
  return part;
}

void ClientLink::said_state(const v1::UpPacket& part, Time now) {
  if (!part.has_state()) return;
  said_ = state_;
  said_at_ = now;
  if (part.state().has_effort()) {
    effort_at_ = now;
    effort_tool_ = state_->state.tool_name;
  }
  moved_ = false;
}

Time ClientLink::next(Time now) const { return endpoint_.next(now, std::min(state_due(), push_due())); }

std::span<const std::uint8_t> ClientLink::send(Time now, std::span<std::uint8_t> into) {
  if (next(now) > now) return {};
  PacketFiller<v1::UpPacket> filler(endpoint_.room(now));
  const std::uint64_t arrived = arrived_.acknowledged();
  auto head = endpoint_.head<v1::UpPacket>(now, arrived, arrived_.beyond(arrived));
  if (echoes_left_ > 0) {
    --echoes_left_;
    head.set_path_echo(echo_.data(), echo_.size());
  }
  const bool has_room = filler.add(head);
  OSTEON_CHECK(has_room);
  // Load and state go before repeated cuts, but must leave room for the next cut, which otherwise might never be sent.
  v1::UpPacket push;
  if (push_due() <= now) *push.mutable_push() = to_wire(*push_);
  if (push.has_push() && push.ByteSizeLong() + endpoint_.window().least_room(now) <= filler.room() &&
      filler.add(push)) {
    push_.reset();
    pushed_at_ = now;
  }
  const v1::UpPacket state = state_part(now);
  if (state.ByteSizeLong() + endpoint_.window().least_room(now) <= filler.room() && filler.add(state))
    said_state(state, now);
  endpoint_.add_items(filler, now);
  return endpoint_.seal(filler.take(), now, into);
}

}  // namespace osteon::wire
