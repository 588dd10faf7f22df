// Controls the sending pace of one end of a session: when the next packet goes, how large it may be, and in how many
// packets each item is repeated. Pure: time is a parameter. One thread.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "common/link/datagram.hpp"

namespace osteon {

struct SendRateParams {
  std::chrono::nanoseconds interval = std::chrono::milliseconds(8);  // between packets while there is something to send
  // Between packets with new items, as long as the rate allows: a cut that is sent sooner is felt sooner.
  std::chrono::nanoseconds fresh_interval = std::chrono::milliseconds(4);
  // between packets that only keep the session alive
  std::chrono::nanoseconds idle_interval = std::chrono::milliseconds(250);
  double bytes_per_s = 300'000.0 / 8.0;
  std::size_t burst_bytes = 2 * (kMostDatagramBytes + 28);  // that may go at once after a pause
  std::size_t overhead_bytes = 28;                          // headers of UDP and IPv4, which count
  // A packet waits until it may have at least this many bytes, headers included. At a low rate, few packets with
  // content are better than many that consist mostly of headers.
  std::size_t least_bytes = 280;
  int fewest_repeats = 2, most_repeats = 12;
  // share of items that may be a round trip late because none of the packets that arrived contained them
  double late_share = 0.0002;
};

class SendRate {
 public:
  using Time = std::chrono::nanoseconds;  // since any start, the same for every call

  explicit SendRate(SendRateParams params = {}) : params_(params), tokens_(static_cast<double>(params.burst_bytes)) {}

  // When the next packet may go, at `now` or later. `wanted`: when there will be something to send; `now` or earlier
  // means at once. Time::max() means nothing; then the next packet only keeps the session alive. `needed_bytes`: the
  // least budget() that makes a packet useful, for example for one long item. `fresh`: the content was never sent
  // before.
  [[nodiscard]] Time next(Time now, Time wanted, std::size_t needed_bytes = 0, bool fresh = false) const;
  // Largest whole datagram that may go now, at most kMostDatagramBytes. 0 if next() is later.
  [[nodiscard]] std::size_t budget(Time now, bool fresh = false) const;
  // A datagram of this many bytes was sent.
  void sent(Time now, std::size_t bytes);

  // What each packet of the other end reports about our packets: the newest counter that it has seen, and how many
  // packets arrived, repeats of the network not counted. Values that do not advance are ignored.
  void acknowledge(std::uint64_t newest_counter, std::uint64_t received);
  void set_round_trip(Time round_trip) { round_trip_ = round_trip; }
  // Share of packets lost lately, 0 to 1, smoothed over about 64 packets. 0.1 before the first packet.
  [[nodiscard]] double loss() const { return std::clamp(loss_, 0.0, 1.0); }
  // How many packets contain each item: the fewest k with loss^k R/T <= late_share (send_window.hpp), within the
  // bounds.
  [[nodiscard]] int repeats() const;

 private:
  [[nodiscard]] double tokens(Time now) const;

  SendRateParams params_;
  Time last_ = Time::min();  // when the last packet went; min: none yet
  Time filled_{};            // when tokens_ was updated
  double tokens_;            // bytes that may go
  Time round_trip_ = std::chrono::milliseconds(200);
  double loss_ = 0.1;  // may leave 0 to 1 while late packets are counted
  std::uint64_t newest_ = 0, received_ = 0;
};

}  // namespace osteon
