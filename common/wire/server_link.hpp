// The room's end of the fast path of one session; ClientLink is the other end. A state machine that is polled: no
// socket, no clock, no thread.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include "common/link/path_watch.hpp"
#include "common/link/receive_window.hpp"
#include "common/wire/bone_motion.hpp"
#include "common/wire/cut_run.hpp"
#include "common/wire/link_endpoint.hpp"
#include "common/wire/tool_state.hpp"

namespace osteon::wire {

// One thread. `now`: since any start, never negative, the same for all calls.
class ServerLink {
 public:
  using Time = LinkEndpoint::Time;
  static constexpr std::size_t kMostPartners = 16;

  // `first_author_seq`: number of the first cut to arrive. `first_index`: index of the first entry to be pushed.
  // `random`: for the tokens of challenges.
  ServerLink(const SessionKeys& keys, AuthorId author, FillRandom random, std::uint64_t first_author_seq = 1,
             std::uint64_t first_index = 1, const LinkOptions& options = server_link_options());

  // As sent to the session over the stream, or about to be sent.
  [[nodiscard]] ToolNumbers& tools() { return tools_; }

  // Accepts any bytes from any address. A datagram that is not authentic changes nothing and gets no answer.
  void receive(const Endpoint& from, std::span<const std::uint8_t> datagram, Time now);
  // A cut that came over the stream. False: it arrived before, or is too far ahead of what was taken.
  bool insert(const Cut& cut) { return cuts_.insert(cut.author_seq, cut); }
  // Cuts in order of their author_seq, each once.
  [[nodiscard]] std::optional<Cut> take_cut() { return cuts_.take(); }
  // Cuts up to this one were decided and the decisions are durable, so they are acknowledged. This includes cuts of an
  // earlier session of this author that are decided only now.
  void decided(std::uint64_t author_seq);
  // Newest state of the tool, once.
  [[nodiscard]] std::optional<KnownToolState> take_state();
  // Newest load on the bone, once.
  [[nodiscard]] std::optional<MountLoad> take_push() { return std::exchange(push_, std::nullopt); }

  // Takes every entry of the session, in order of its index. False: the client gets it over the stream only, because it
  // is of kind streamed, too long for a packet, or too much is unacknowledged. While the link is not alive(), every
  // entry above acknowledged() goes over the stream too.
  [[nodiscard]] bool push(const IndexedEntry& entry);
  // Sends an entry to the session's client. If it is the client's own cut, or rejects one, that cut is decided and
  // durable. A rejection also raises the lease. The entry is pushed unless `index` is 0; then it has no number, because
  // it was part of what the client received first.
  bool enqueue(std::uint64_t index, const SessionEntry& entry);
  // The session reports over the stream that it has taken the entries up to this one.
  void acknowledge(std::uint64_t index) { endpoint_.acknowledge(index); }
  // The author has left and sends no more cuts.
  void forget(AuthorId author) { sender_.forget(author); }
  // Newest states of others' tools; at most kMostPartners are used. A tool that is missing is not sent any more.
  void set_partners(std::span<const KnownToolState> partners);
  // Newest pose of the bone on its mount. It is sent once, soon, unless a newer one replaces it.
  void set_bone(const MountPose& bone) { bone_ = bone; }
  void set_lease_epoch(std::uint64_t epoch);
  void set_frozen(bool frozen);

  struct Out {
    Endpoint to;
    std::span<const std::uint8_t> bytes;
  };
  // When send() has something beside challenges, at `now` or later. Time::max() before the client's address is proven.
  // Challenges are due after receive() and then in later turns, so call send() in every turn of the loop.
  [[nodiscard]] Time next(Time now) const;
  // What is due, within `into` (kMostDatagramBytes). Call it until it returns nothing.
  [[nodiscard]] std::optional<Out> send(Time now, std::span<std::uint8_t> into);

  // The client is known to be at address(), and a packet came from there lately.
  [[nodiscard]] bool alive(Time now) const { return endpoint_.alive(now); }
  [[nodiscard]] const Endpoint& address() const { return path_.address(); }
  [[nodiscard]] std::uint64_t moves() const { return path_.moves(); }
  // The session has taken the entries up to this one.
  [[nodiscard]] std::uint64_t acknowledged() const { return endpoint_.acknowledged(); }
  // The estimate of the client's clock, and the round trip.
  [[nodiscard]] std::optional<ClockReading> clock(Time now) const { return endpoint_.clock(now); }
  [[nodiscard]] double loss() const { return endpoint_.rate().loss(); }  // on the way down
  [[nodiscard]] const LinkEndpoint& half() const { return endpoint_; }

 private:
  struct Partner {
    KnownToolState state;
    std::uint64_t said_seq = 0;
    Time said_at = -std::chrono::hours(1), effort_at = said_at;
  };
  [[nodiscard]] Time due(const Partner& partner) const;
  [[nodiscard]] Time bone_due() const;
  [[nodiscard]] std::optional<Out> challenge(Time now, std::span<std::uint8_t> into);
  void add_partners(PacketFiller<v1::DownPacket>& filler, Time now, std::size_t keep_free);

  LinkEndpoint endpoint_;
  ToolNumbers tools_;
  const AuthorId author_;
  PathWatch path_;
  ReceiveWindow<Cut> cuts_;
  std::uint64_t decided_;
  KnownToolState state_;
  bool state_is_new_ = false;
  std::optional<MountLoad> push_;  // newest that was not taken yet
  std::uint64_t push_seq_ = 0;
  std::optional<MountPose> bone_;  // newest that was not sent yet
  Time bone_at_ = -std::chrono::hours(1);

  EntrySender sender_;
  std::map<std::uint64_t, Partner> partners_;  // by author
  std::uint64_t lease_epoch_ = 0;
  bool frozen_ = false;
};

}  // namespace osteon::wire
