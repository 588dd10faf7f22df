// The two ends of a session, made of SendWindow, ReceiveWindow and SendRate over any DatagramPort. They are as simple
// as possible: plain bytes, not sealed. For carrying_test and for the measurements of send_window_test.
#pragma once
#include <cstring>
#include <functional>
#include <string>

#include "common/core/check.hpp"
#include "common/link/receive_window.hpp"
#include "common/link/replay_window.hpp"
#include "common/link/send_rate.hpp"
#include "common/link/send_window.hpp"

namespace osteon::test {

struct PeerParams {
  SendWindowLimits window;
  SendRateParams rate;
  int repeats = 0;                    // 0: as SendRate chooses
  std::size_t budget = 0;             // most bytes of a datagram, 0: as SendRate chooses
  std::size_t fixed_bytes = 29 + 60;  // bytes of a real packet beside its items: seal, acknowledgement, times, a pose
  std::uint64_t most_ahead = 1024;
};

// The largest values, for the bounds that a test checks.
struct PeerExtremes {
  std::size_t waiting_bytes = 0, waiting_items = 0, held = 0, datagram = 0;
  std::uint64_t datagrams = 0, bytes = 0;  // with 28 B of header each
};

// Reads from a packet what Peer has written.
struct PacketReader {
  std::span<const std::uint8_t> bytes;
  template <class T>
  T get() {
    T value{};
    OSTEON_CHECK(bytes.size() >= sizeof value);
    std::memcpy(&value, bytes.data(), sizeof value);
    skip(sizeof value);
    return value;
  }
  std::string text(std::size_t length) {
    std::string out(reinterpret_cast<const char*>(bytes.data()), length);
    skip(length);
    return out;
  }
  void skip(std::size_t count) { bytes = bytes.subspan(count); }
};

template <class Receive = ReceiveWindow<std::string>>
class Peer {
 public:
  using Time = SendWindow::Time;

  Peer(DatagramPort& port, const Endpoint& to, const PeerParams& params, std::function<void(std::string)> take)
      : port_(port),
        to_(to),
        params_(params),
        window_(params.window),
        rate_(params.rate),
        in_(1, params.most_ahead),
        take_(std::move(take)) {}

  // An item of at most 254 bytes, since its first byte is its length. The head has at least 5 bytes for a mark and the
  // number. `follows`: its head is saved after the item before. Returns false if the window is full.
  bool say(const std::string& bytes, std::string head, bool follows) {
    OSTEON_CHECK(bytes.size() < kHead && head.size() >= 5);
    return window_.push({static_cast<char>(bytes.size()) + bytes, std::move(head), follows ? window_.next() - 1 : 0})
        .has_value();
  }

  void heard(const Datagram& datagram, Time now) {
    PacketReader in{datagram.bytes};
    const auto counter = in.get<std::uint64_t>(), acknowledged = in.get<std::uint64_t>(),
               newest = in.get<std::uint64_t>(), received = in.get<std::uint64_t>(), beyond = in.get<std::uint64_t>();
    const auto echo = in.get<std::int64_t>(), sent = in.get<std::int64_t>();
    in.skip(params_.fixed_bytes - 7 * 8);
    if (!replays_.is_fresh(counter)) return;
    replays_.mark(counter);
    ++received_;
    if (counter > newest_) {
      newest_ = counter;
      echo_ = Time(sent);
      echo_came_ = now;
    }
    if (echo != 0) {
      const Time round_trip = now - Time(echo);
      fastest_ = fastest_ == Time{} ? round_trip : std::min(fastest_, round_trip);
      window_.set_round_trip(fastest_);
      rate_.set_round_trip(fastest_);
    }
    rate_.acknowledge(newest, received);
    window_.acknowledge(acknowledged, beyond);
    for (std::uint32_t number = 0; !in.bytes.empty(); ++number) {
      auto length = in.get<std::uint8_t>();
      if (length == kHead) {
        number = in.get<std::uint32_t>();
        length = in.get<std::uint8_t>();
      }
      in_.insert(number, in.text(length));
    }
    extremes_.held = std::max(extremes_.held, in_.held());
    while (auto item = in_.take()) take_(std::move(*item));
    unsaid_ = unsaid_ || in_.acknowledged() != said_ || in_.beyond(in_.acknowledged()) != said_beyond_;
  }

  // Sends what is due.
  void step(Time now) {
    extremes_.waiting_bytes = std::max(extremes_.waiting_bytes, window_.bytes_unacknowledged());
    extremes_.waiting_items = std::max(extremes_.waiting_items, window_.items_unacknowledged());
    const int repeats = params_.repeats > 0 ? params_.repeats : rate_.repeats();
    const Time wanted = unsaid_ ? now : window_.next_due(now, repeats).value_or(Time::max());
    if (rate_.next(now, wanted, params_.fixed_bytes + window_.least_room(now)) > now) return;
    std::size_t budget = rate_.budget(now);
    if (params_.budget > 0) budget = std::min(budget, params_.budget);
    if (budget <= params_.fixed_bytes) return;
    std::string out;
    put<std::uint64_t>(out, ++counter_);
    put<std::uint64_t>(out, in_.acknowledged());
    put<std::uint64_t>(out, newest_);
    put<std::uint64_t>(out, received_);
    put<std::uint64_t>(out, in_.beyond(in_.acknowledged()));
    // The time for which the echo was held back here is not part of the round trip.
    put<std::int64_t>(out, newest_ == 0 ? 0 : (echo_ + (now - echo_came_)).count());
    put<std::int64_t>(out, now.count());
    out.resize(params_.fixed_bytes);
    const auto picked = window_.pick(now, budget - params_.fixed_bytes, repeats);
    // A head counts with its declared length. Only its number is written.
    for (const std::uint64_t number : picked.numbers) {
      if (window_.needs_head(number, picked)) {
        put<std::uint8_t>(out, kHead);
        put<std::uint32_t>(out, static_cast<std::uint32_t>(number));
      }
      out += window_.item(number).bytes;
    }
    unsaid_ = false;
    said_ = in_.acknowledged();
    said_beyond_ = in_.beyond(said_);
    const std::size_t counted = params_.fixed_bytes + picked.bytes;
    rate_.sent(now, counted);
    extremes_.datagram = std::max(extremes_.datagram, counted);
    ++extremes_.datagrams;
    extremes_.bytes += counted + 28;
    port_.send(to_, {reinterpret_cast<const std::uint8_t*>(out.data()), out.size()});
  }

  [[nodiscard]] const SendWindow& window() const { return window_; }
  [[nodiscard]] const SendRate& rate() const { return rate_; }
  [[nodiscard]] const Receive& in() const { return in_; }
  [[nodiscard]] const PeerExtremes& extremes() const { return extremes_; }
  [[nodiscard]] Time fastest_round_trip() const { return fastest_; }

 private:
  static constexpr std::uint8_t kHead = 255;
  template <class T>
  static void put(std::string& out, T value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
  }

  DatagramPort& port_;
  Endpoint to_;
  PeerParams params_;
  SendWindow window_;
  SendRate rate_;
  Receive in_;
  ReplayWindow replays_;
  std::function<void(std::string)> take_;
  std::uint64_t counter_ = 0, newest_ = 0, received_ = 0;
  Time echo_{}, echo_came_{}, fastest_{};
  bool unsaid_ = false;  // received, not yet acknowledged
  std::uint64_t said_ = 0, said_beyond_ = 0;
  PeerExtremes extremes_;
};

}  // namespace osteon::test
