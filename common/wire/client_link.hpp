// A haptic client's end of the fast path. It sends its cuts and its tool's state in sealed datagrams. It receives the
// room's decisions and the states of partners' tools. A state machine that is polled: no socket, no clock, no thread.
//
// The stream always runs beside it and carries what cannot go in datagrams. Both ends merge the two by number, so it
// does not matter which copy arrives first.
#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "common/link/receive_window.hpp"
#include "common/wire/bone_motion.hpp"
#include "common/wire/cut_run.hpp"
#include "common/wire/link_endpoint.hpp"
#include "common/wire/tool_state.hpp"

namespace osteon::wire {

// One thread. `now`: since any start, never negative, the same for all calls.
class ClientLink {
 public:
  using Time = LinkEndpoint::Time;
  static constexpr std::size_t kMostPartners = 16;

  // `first_author_seq`: number of the first cut to be pushed. `first_index`: index of the first entry to arrive.
  ClientLink(const SessionKeys& keys, std::uint64_t first_author_seq = 1, std::uint64_t first_index = 1,
             const LinkOptions& options = {});

  // As the room has sent them over the stream.
  [[nodiscard]] ToolNumbers& tools() { return tools_; }

  // Takes every cut of this author, in order. Cuts decided before their turn may be missing, because an earlier session
  // sent them. False: send it over the stream, since it is too long for a packet or too much is unacknowledged. While
  // the link is not alive(), every cut above acknowledged() goes over the stream too.
  [[nodiscard]] bool push(const Cut& cut);
  // The stream reports that cuts up to this one are decided and durable.
  void acknowledge(std::uint64_t author_seq) { endpoint_.acknowledge(author_seq); }
  // Newest state of the tool. Call it for every state; state_seq rises. A state is sent at once if the tool has moved
  // by more than the deadband. It is sent some 30 times a second while the tool touches the bone, and now and then
  // otherwise.
  void set_state(const CuttingState& state, std::uint32_t buttons);
  // Newest load on a bone on its mount. It is sent once, soon, unless a newer one replaces it.
  void set_push(const MountLoad& push) { push_ = push; }

  // Accepts any bytes.
  void receive(std::span<const std::uint8_t> datagram, Time now);
  // The stream has delivered this entry. False: it arrived before, or is too far ahead of those that have arrived.
  bool received_one(std::uint64_t index) { return note_arrival(index); }
  // The stream has delivered this entry and all entries before it that did not arrive here.
  void received(std::uint64_t index) { arrived_.skip(index); }
  // Entries in the order of their arrival, each once, and none that the stream delivered before. The caller restores
  // the room's order, together with what the stream delivers. Take all of them after each receive().
  [[nodiscard]] std::optional<IndexedEntry> take_entry();

  // When send() has something to send, at `now` or later. Ask again after any other call.
  [[nodiscard]] Time next(Time now) const;
  // The datagram that is due to the server, within `into` (kMostDatagramBytes). Empty if there is none.
  [[nodiscard]] std::span<const std::uint8_t> send(Time now, std::span<std::uint8_t> into);

  // Datagrams get through in both directions. The server recently sent one that it sends only to a proven address, and
  // it reported that a recent one of ours arrived.
  [[nodiscard]] bool alive(Time now) const {
    return endpoint_.alive(now) && now - arrived_at_ < 2 * endpoint_.options().alive_for;
  }
  // Cuts up to this one are decided and durable.
  [[nodiscard]] std::uint64_t acknowledged() const { return endpoint_.acknowledged(); }
  // Entries up to this one have arrived, here or over the stream.
  [[nodiscard]] std::uint64_t entries_arrived() const { return arrived_.acknowledged(); }
  // As of the newest packet. 0 before the first.
  [[nodiscard]] std::uint64_t lease_epoch() const { return lease_epoch_; }
  [[nodiscard]] bool frozen() const { return frozen_; }
  // Tools whose state arrived within the last two seconds.
  [[nodiscard]] std::vector<KnownToolState> partners(Time now) const;
  // The newest pose of the bone on its mount, once. Nothing if it stands on none.
  [[nodiscard]] std::optional<MountPose> take_bone() { return std::exchange(bone_, std::nullopt); }
  // The estimate of the server's clock, and the round trip.
  [[nodiscard]] std::optional<ClockReading> clock(Time now) const { return endpoint_.clock(now); }
  [[nodiscard]] double loss() const { return endpoint_.rate().loss(); }  // on the way up
  [[nodiscard]] const LinkEndpoint& half() const { return endpoint_; }

 private:
  struct Partner {
    KnownToolState state;
    Time received_at{};
  };
  bool note_arrival(std::uint64_t index);
  void keep_partner(KnownToolState state, Time now);
  [[nodiscard]] Time state_due() const;
  [[nodiscard]] Time effort_interval() const;
  [[nodiscard]] Time push_due() const;
  [[nodiscard]] v1::UpPacket state_part(Time now) const;
  void said_state(const v1::UpPacket& part, Time now);

  LinkEndpoint endpoint_;
  ToolNumbers tools_;
  std::optional<CutSender>
      sender_;               // codes each cut against the one before it; a new one if that cut is not in the window
  std::uint64_t coded_ = 0;  // the last cut that it coded
  ReceiveWindow<std::monostate> arrived_;      // the numbers alone: it says what to acknowledge, and what is repeated
  std::deque<IndexedEntry> entries_;           // that were not taken yet
  std::map<std::uint64_t, Partner> partners_;  // by author
  std::uint64_t lease_epoch_ = 0;
  bool frozen_ = false;
  Time arrived_at_ =
      -std::chrono::hours(1);  // when the newest packet was sent of which the server says that it arrived

  std::optional<KnownToolState> state_, said_;  // newest, and last sent
  bool moved_ = false;                          // whether they differ by more than the deadband
  Time said_at_ = -std::chrono::hours(1), effort_at_ = said_at_;
  // The newest effort's. Blows are counted for each tool, so a count must not come under another tool's name.
  std::string effort_tool_;
  std::optional<MountLoad> push_;  // newest that was not sent yet
  Time pushed_at_ = -std::chrono::hours(1);
  std::optional<MountPose> bone_;  // newest that was not taken yet
  std::uint64_t bone_seq_ = 0;
  PathToken echo_{};
  int echoes_left_ = 0;
};

}  // namespace osteon::wire
