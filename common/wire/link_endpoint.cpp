#include "common/wire/link_endpoint.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"

namespace osteon::wire {
namespace {

using namespace std::chrono_literals;
using Time = LinkEndpoint::Time;

// Largest size of a packet's content beside items and states: the seal, times, acknowledgement, a path token, epoch and
// frozen.
constexpr std::size_t kFixedBytes = kSealBytes + 57 + 22 + 18 + 14;

std::uint64_t in_us(Time time) { return static_cast<std::uint64_t>(time / 1us); }

// Nothing for a time that no clock shows.
std::optional<Time> from_us(std::uint64_t us) {
  constexpr std::uint64_t kMost_us = std::uint64_t{1} << 50;  // 36 years
  return us < kMost_us ? std::optional<Time>(std::chrono::microseconds(us)) : std::nullopt;
}

}  // namespace

LinkOptions server_link_options() {
  LinkOptions options;
  options.rate.interval = 4ms;
  options.rate.fresh_interval = 1ms;
  options.rate.bytes_per_s = 1'000'000.0 / 8.0;
  return options;
}

LinkEndpoint::LinkEndpoint(std::uint32_t session, const SealKey& out, const SealKey& in, std::uint64_t first,
                           const LinkOptions& options)
    : options_(options),
      sealer_(session, out, options.seal),
      opener_(session, in, options.seal),
      window_(options.window, first),
      rate_(options.rate),
      last_(first - 1),
      acknowledged_(first - 1),
      sent_upto_(first - 1) {
  OSTEON_CHECK(first > 0);
}

std::optional<Opened> LinkEndpoint::open(std::span<const std::uint8_t> datagram, Time now,
                                         std::span<std::uint8_t> into) {
  const auto opened = opener_.open(datagram, now, into);
  if (!opened) return {};
  ++counts_.packets_received;
  counts_.bytes_received += datagram.size();
  newest_ = std::max(newest_, opened->counter);
  return opened;
}

void LinkEndpoint::read_times(const v1::PacketTimes& times, const Opened& opened, Time now) {
  if (opened.newest) {
    peer_sent_us_ = times.sent_us();
    peer_came_ = now;
  }
  // None of our packets had arrived yet, or the report names packets that were never sent.
  if (times.received_counter() == 0 || times.received_counter() >= sealer_.counter() ||
      times.received_packets() > counts_.packets_sent)
    return;
  rate_.acknowledge(times.received_counter(), times.received_packets());
  const auto sent = from_us(times.echo_sent_us()), peer_received = from_us(times.echo_received_us()),
             peer_sent = from_us(times.sent_us());
  if (!sent || !peer_received || !peer_sent || !clock_.add({*sent, *peer_received, *peer_sent, now})) return;
  const Time round_trip = clock_.at(now)->round_trip;
  window_.set_round_trip(round_trip);
  rate_.set_round_trip(round_trip);
}

bool LinkEndpoint::acknowledge(std::uint64_t upto, std::uint64_t beyond) {
  if (upto > last_) return false;
  acknowledged_ = std::max(acknowledged_, upto);
  if (upto <= sent_upto_) {
    window_.acknowledge(upto, beyond);
    return true;
  }
  // The item arrived over the stream before any packet contained it. The remaining items were in no packet either.
  sent_upto_ = std::min(upto, window_.next() - 1);
  const bool known = window_.restart(sent_upto_);
  OSTEON_CHECK(known);
  return true;
}

bool LinkEndpoint::begin(std::uint64_t number) {
  OSTEON_CHECK(number > last_);
  last_ = number;
  if (window_.empty() && window_.next() != number) {
    // All earlier items went over the stream.
    window_ = SendWindow(options_.window, number);
    if (const auto reading = peer_came_ ? clock_.at(*peer_came_) : std::nullopt)
      window_.set_round_trip(reading->round_trip);
    sent_upto_ = number - 1;
  }
  while (window_.next() < number)
    if (!window_.push({})) return false;
  return true;
}

Time LinkEndpoint::keep_alive_interval() const {
  // The other end gives up when all packets of `alive_for` are lost: k packets, with loss^k <= 10^-4. One more is added
  // because delays vary. An unknown path counts as a bad one, so that the first packet gets through soon.
  const double loss = received_at_ ? std::clamp(rate_.loss(), 0.01, 0.5) : 0.5;
  const auto packets = static_cast<int>(std::ceil(std::log(1e-4) / std::log(loss))) + 1;
  return options_.alive_for / packets;
}

Time LinkEndpoint::next(Time now, Time wanted) const {
  if (!sent_at_) return now;
  if (answer_due_ || news_left_ > 0) wanted = now;
  if (const auto due = window_.next_due(now, rate_.repeats())) wanted = std::min(wanted, *due);
  const Time keep_alive = *sent_at_ + keep_alive_interval();
  // If nobody answers, packets only test whether the other end is back.
  wanted = alive(now) ? std::min(wanted, keep_alive) : keep_alive;
  return rate_.next(now, wanted, kFixedBytes + window_.least_room(now), fresh(now));
}

bool LinkEndpoint::fresh(Time now) const { return alive(now) && window_.holds_fresh(); }

std::size_t LinkEndpoint::room(Time now) const {
  constexpr std::size_t kAsking = 280;  // used while the other end may be unreachable
  const std::size_t budget = rate_.budget(now, fresh(now));
  return (alive(now) ? budget : std::min(budget, kAsking)) - kSealBytes;
}

void LinkEndpoint::put_times(v1::PacketTimes& times, Time now) const {
  times.set_sent_us(in_us(now));
  times.set_received_counter(newest_);
  times.set_received_packets(counts_.packets_received);
  if (!peer_came_) return;
  times.set_echo_sent_us(peer_sent_us_);
  times.set_echo_received_us(in_us(*peer_came_));
}

std::span<const std::uint8_t> LinkEndpoint::seal(std::string_view plain, Time now, std::span<std::uint8_t> into) {
  rate_.sent(now, plain.size() + kSealBytes);
  sent_at_ = now;
  answer_due_ = false;
  news_left_ = std::max(0, news_left_ - 1);
  return seal_beside(plain, now, into);
}

std::span<const std::uint8_t> LinkEndpoint::seal_beside(std::string_view plain, Time now,
                                                        std::span<std::uint8_t> into) {
  const auto datagram = sealer_.seal({reinterpret_cast<const std::uint8_t*>(plain.data()), plain.size()}, now, into);
  ++counts_.packets_sent;
  counts_.bytes_sent += datagram.size();
  return datagram;
}

}  // namespace osteon::wire
