// A haptic client's end of the fast path: its cuts and its tool's state go up in sealed datagrams, what the room
// decided and what partners' tools do comes down. A state machine that is polled: no socket, no clock, no thread.
//
// The stream is always there beside it. What cannot go in datagrams goes over the stream, and both ends put the two
// together by number: which copy comes first does not matter.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/link/receive_window.hpp"
#include "common/wire/bone_motion.hpp"
#include "common/wire/cut_run.hpp"
#include "common/wire/link_endpoint.hpp"
#include "common/wire/tool_state.hpp"

namespace osteon::wire {

// One thread. `now`: since any start, not before it, the same for all calls.
class ClientLink {
 public:
  using Time = LinkEndpoint::Time;
  static constexpr std::size_t kMostPartners = 16;

  // The first cut to be pushed has `first_author_seq`, and the first entry to come `first_index`.
  ClientLink(const SessionKeys& keys, std::uint64_t first_author_seq = 1, std::uint64_t first_index = 1,
             const LinkOptions& options = {});

  // As the room has told them over the stream.
  [[nodiscard]] ToolNumbers& tools() { return tools_; }

  // Every cut of this author, in order, but for those that are decided before it is their turn: an earlier session has
  // brought them. False: it goes over the stream, since it is too long for a packet or too much is
  // unacknowledged. While the link is not alive(), every cut above acknowledged() goes over the stream too.
  [[nodiscard]] bool push(const Cut& cut);
  // The stream's word: cuts up to here are decided and kept.
  void acknowledge(std::uint64_t author_seq) { half_.acknowledge(author_seq); }
  // Newest state of the tool, to be called at every state, whose state_seq rises. It goes at once where the tool has
  // moved by more than the deadband, some 30 times a second while it is at the bone, and now and then in any case.
  void set_state(const CuttingState& state, std::uint32_t buttons);
  // Newest push on a bone on its mount: it goes once, soon, where none newer comes before.
  void set_push(const MountLoad& push) { push_ = push; }

  // Anything may come.
  void receive(std::span<const std::uint8_t> datagram, Time now);
  // The stream's copy of an entry. False: it has come before, or is too far ahead of what was taken.
  bool offer(const IndexedEntry& entry) { return entries_.offer(entry.index, entry.entry); }
  // The stream has brought this entry, and before it all that had not been taken here: none of them comes out any more.
  void heard(std::uint64_t index) { entries_.skip(index); }
  // Rows in order of their index, each once. An entry of kind streamed comes only after its copy was offered.
  [[nodiscard]] std::optional<IndexedEntry> take_entry();

  // When send() has something, at `now` or later; to be asked anew after any other call.
  [[nodiscard]] Time next(Time now) const;
  // The datagram that is due, to the server, within `into` (kMostDatagramBytes); empty: none.
  [[nodiscard]] std::span<const std::uint8_t> send(Time now, std::span<std::uint8_t> into);

  // Datagrams get through both ways: one has come lately that a server sends only where it knows the client to be, and
  // it was said that one that went not long ago has arrived.
  [[nodiscard]] bool alive(Time now) const {
    return half_.alive(now) && now - arrived_at_ < 2 * half_.options().alive_for;
  }
  // Cuts up to this one are decided and kept.
  [[nodiscard]] std::uint64_t acknowledged() const { return half_.acknowledged(); }
  // Rows up to this one have come, and were taken.
  [[nodiscard]] std::uint64_t entries_taken() const { return entries_.acknowledged(); }
  // As of the newest packet; 0 before the first.
  [[nodiscard]] std::uint64_t lease_epoch() const { return lease_epoch_; }
  [[nodiscard]] bool frozen() const { return frozen_; }
  // Tools that were heard of within the last two seconds.
  [[nodiscard]] std::vector<KnownToolState> partners(Time now) const;
  // The newest place of the bone on its mount, once; nothing where it stands on none.
  [[nodiscard]] std::optional<MountPose> take_bone() { return std::exchange(bone_, std::nullopt); }
  // The server's clock as seen from here, and the round trip.
  [[nodiscard]] std::optional<ClockReading> clock(Time now) const { return half_.clock(now); }
  [[nodiscard]] double loss() const { return half_.rate().loss(); }  // on the way up
  [[nodiscard]] const LinkEndpoint& half() const { return half_; }

 private:
  struct Partner {
    KnownToolState state;
    Time heard_at{};
  };
  void keep_partner(KnownToolState state, Time now);
  [[nodiscard]] Time state_due() const;
  [[nodiscard]] Time push_due() const;
  [[nodiscard]] v1::UpPacket state_part(Time now) const;
  void said_state(const v1::UpPacket& part, Time now);

  LinkEndpoint half_;
  ToolNumbers tools_;
  std::optional<CutSender>
      sender_;               // codes each cut against the one before it; a new one where that is not in the window
  std::uint64_t coded_ = 0;  // the last cut that it coded
  ReceiveWindow<SessionEntry> entries_;
  std::map<std::uint64_t, Partner> partners_;  // by author
  std::uint64_t lease_epoch_ = 0;
  bool frozen_ = false;
  Time arrived_at_ =
      -std::chrono::hours(1);  // when the newest packet went of which the server says that it has arrived

  std::optional<KnownToolState> state_, said_;  // newest, and last sent
  bool moved_ = false;                      // from the one to the other, by more than the deadband
  Time said_at_ = -std::chrono::hours(1), effort_at_ = said_at_;
  std::optional<MountLoad> push_;  // newest that has not gone
  Time pushed_at_ = -std::chrono::hours(1);
  std::optional<MountPose> bone_;  // newest that was not taken
  std::uint64_t bone_seq_ = 0;
  PathToken echo_{};
  int echoes_left_ = 0;
};

}  // namespace osteon::wire
