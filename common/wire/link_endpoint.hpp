// The common part of both ends of the fast path: sealing, when a packet goes, which items it repeats, and the other
// end's reports about received packets. ClientLink and ServerLink add the contents of packets.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>

#include "common/link/clock_offset.hpp"
#include "common/link/path_watch.hpp"
#include "common/link/pose_deadband.hpp"
#include "common/link/sealed.hpp"
#include "common/link/send_rate.hpp"
#include "common/link/send_window.hpp"
#include "common/wire/packet_filler.hpp"

namespace osteon::wire {

struct LinkOptions {
  SendRateParams rate;
  SealRules seal;
  SendWindowLimits window{.bytes_per_head = kRunBytes};
  std::uint64_t most_ahead = 1024;  // items that arrived and wait for an earlier one
  // After this time without a packet the link counts as dead. Its content then goes over the stream as well.
  std::chrono::nanoseconds alive_for = std::chrono::milliseconds(500);
  // At 30 % loss each way all challenges are lost in one address change of 1000. The others take less than a second.
  PathRules path{.retry_after = std::chrono::milliseconds(100), .tries = 6};
  PoseDeadband deadband;
  std::chrono::nanoseconds effort_interval = std::chrono::milliseconds(33);  // between forces and the like of one tool
  std::chrono::nanoseconds state_interval = std::chrono::milliseconds(16);   // between states of one moving tool
  std::chrono::nanoseconds bone_interval =
      std::chrono::milliseconds(8);  // between loads, and between poses of the bone
  std::chrono::nanoseconds times_interval = std::chrono::milliseconds(30);  // between packets that contain times
};
// The rate limit down is not as tight as the one up, and what a session receives waits for its next packet.
[[nodiscard]] LinkOptions server_link_options();

struct LinkCounts {
  std::uint64_t packets_sent = 0, bytes_sent = 0;          // sealed, without headers of UDP and IP
  std::uint64_t packets_received = 0, bytes_received = 0;  // authentic packets, each counted once
  std::uint64_t malformed = 0;  // authentic, but not what a correct peer sends; nothing was taken from them
  std::uint64_t left_out = 0;   // runs whose tool was not known yet
  std::uint64_t streamed = 0;   // items that could only go over the stream
};

// Items are numbered one by one. Items that cannot go in packets reach the other end over the stream, under their
// number. In the window they are items without bytes, which are acknowledged like all others. One thread. Times are
// since any start, never negative.
class LinkEndpoint {
 public:
  using Time = std::chrono::nanoseconds;

  // `first`: number of the first item to send.
  LinkEndpoint(std::uint32_t session, const SealKey& out, const SealKey& in, std::uint64_t first,
               const LinkOptions& options);
  LinkEndpoint(const LinkEndpoint&) = delete;
  LinkEndpoint& operator=(const LinkEndpoint&) = delete;

  // --- receiving
  // The plain bytes of an authentic datagram that did not arrive before, within `into` (kMostDatagramBytes).
  [[nodiscard]] std::optional<Opened> open(std::span<const std::uint8_t> datagram, Time now,
                                           std::span<std::uint8_t> into);
  void malformed() { ++counts_.malformed; }
  void left_out(std::uint64_t runs) { counts_.left_out += runs; }
  // Processes what a packet reports about our packets. Reports that no correct peer makes are ignored.
  template <class Packet>
  void read_times(const Packet& packet, const Opened& opened, Time now) {
    if (packet.has_times()) read_times(packet.times(), opened, now);
    acknowledge(packet.acknowledged(), packet.acknowledged_beyond());
  }
  // Marks the other end as alive, by a packet which shows that it can be reached.
  void is_alive(Time now) { received_at_ = now; }
  // See SendWindow::acknowledge. `upto` may lie beyond all items that were ever in packets. False if no such item
  // exists.
  bool acknowledge(std::uint64_t upto, std::uint64_t beyond = 0);

  // --- sending
  // Announces the next item and prepares the window for it. False if the item must go over the stream. Every item is
  // announced here, in order, except those that the other end is known to have.
  [[nodiscard]] bool begin(std::uint64_t number);
  void goes_over_stream() { ++counts_.streamed; }
  // There is something to acknowledge. It goes with the next packet.
  void answer() { answer_due_ = true; }
  // News that nobody acknowledges goes at once, in this many packets, because some are lost.
  void repeat_news(int packets) { news_left_ = std::max(news_left_, packets); }

  // When a packet goes. `wanted`: when the caller wants one; Time::max(): not at all.
  [[nodiscard]] Time next(Time now, Time wanted) const;
  // Plain bytes that the next packet may have.
  [[nodiscard]] std::size_t room(Time now) const;
  // The first part of a packet. `acknowledged`, `beyond`: of received items (ReceiveWindow).
  template <class Packet>
  [[nodiscard]] Packet head(Time now, std::uint64_t acknowledged, std::uint64_t beyond) {
    Packet packet;
    if (!timed_at_ || now - *timed_at_ >= options_.times_interval) {
      put_times(*packet.mutable_times(), now);
      timed_at_ = now;
    }
    packet.set_acknowledged(acknowledged);
    packet.set_acknowledged_beyond(beyond);
    return packet;
  }
  template <class Packet>
  void add_items(PacketFiller<Packet>& filler, Time now) {
    const SendWindow::Picked picked = filler.add_items(window_, now, rate_.repeats());
    if (!picked.numbers.empty()) sent_upto_ = std::max(sent_upto_, picked.numbers.back());
  }
  // Seals a datagram into the beginning of `into` (kMostDatagramBytes), and counts it as sent now.
  std::span<const std::uint8_t> seal(std::string_view plain, Time now, std::span<std::uint8_t> into);
  // Seals a datagram that is outside the pace.
  std::span<const std::uint8_t> seal_beside(std::string_view plain, Time now, std::span<std::uint8_t> into);

  // --- state
  [[nodiscard]] bool alive(Time now) const { return received_at_ && now - *received_at_ < options_.alive_for; }
  [[nodiscard]] std::uint64_t acknowledged() const { return acknowledged_; }
  [[nodiscard]] SendWindow& window() { return window_; }
  [[nodiscard]] const SendWindow& window() const { return window_; }
  [[nodiscard]] const SendRate& rate() const { return rate_; }
  [[nodiscard]] std::optional<ClockReading> clock(Time now) const { return clock_.at(now); }
  [[nodiscard]] const LinkCounts& counts() const { return counts_; }
  [[nodiscard]] const OpenCounts& open_counts() const { return opener_.counts(); }
  [[nodiscard]] const LinkOptions& options() const { return options_; }

 private:
  void read_times(const v1::PacketTimes& times, const Opened& opened, Time now);
  void put_times(v1::PacketTimes& times, Time now) const;
  [[nodiscard]] Time keep_alive_interval() const;
  [[nodiscard]] bool fresh(Time now) const;  // something waits that was never sent, and may go sooner than repeats

  const LinkOptions options_;
  Sealer sealer_;
  Opener opener_;
  SendWindow window_;
  SendRate rate_;
  ClockOffset clock_;
  LinkCounts counts_;
  std::uint64_t last_;          // last item that was announced
  std::uint64_t acknowledged_;  // every item up to this one
  std::uint64_t sent_upto_;     // every item up to this one was in a packet, or arrived without one
  std::uint64_t newest_ = 0;    // newest counter received
  // Of the newest packet with times: its own send time, and when it arrived.
  std::uint64_t peer_sent_us_ = 0;
  std::optional<Time> peer_came_;
  std::optional<Time> received_at_, sent_at_, timed_at_;
  bool answer_due_ = false;
  int news_left_ = 0;
};

}  // namespace osteon::wire
