// Two haptic clients and a room, joined by ClientLink and ServerLink over a simulated network, with a stream beside it.
// This is the simplest owner of each end. The room commits cuts 120 times a second, writes them 2 ms later, and sends
// each client their log entries.
#pragma once
#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "common/wire/client_link.hpp"
#include "common/wire/server_link.hpp"
#include "tests/support/network/sim_network.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon::test {

using namespace std::chrono_literals;
using Time = VirtualTime::Time;

struct TrialOptions {
  std::uint64_t seed = 1;
  PathQuality quality;
  wire::LinkOptions up{}, down = wire::server_link_options();
  Time stream_delay = 100ms;  // one way
  double long_cuts = 0.02;    // too long for a packet
  double events = 0.01;       // share of ticks with an event that only the stream carries
  std::uint64_t reject_each = 40;
  std::function<Cut(std::size_t client, std::uint64_t number)> cut{};  // empty: an invented drilling
};

// A seeded generator, as a session's source of tokens and keys.
inline FillRandom seeded(std::uint64_t seed) {
  return [random = std::make_shared<Random>(seed)](std::span<std::uint8_t> bytes) {
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random->index(256));
  };
}

class Trial {
 public:
  static constexpr std::size_t kClients = 2;
  static constexpr Time kTick = Time(1'000'000'000 / 120), kCut = 8ms, kWrite = 2ms;

  struct Client {
    Client(std::size_t which, const SessionKeys& session, const TrialOptions& options)
        : author{10 + which}, keys(session), link(keys, 1, 1, options.up) {}
    AuthorId author;
    SessionKeys keys;
    wire::ClientLink link;
    std::unique_ptr<SimPort> port;
    std::vector<Cut> cuts;  // all that the client made, by author_seq - 1
    std::vector<Time> made_at;
    std::uint64_t streamed_cuts = 0;             // the stream has carried these
    ReceiveWindow<wire::SessionEntry> in_order;  // of datagrams and stream, as in SessionReader
    std::vector<wire::IndexedEntry> entries;     // all that the client took, in order
    std::vector<double> felt_ms;                 // from a partner's cut until its log entry arrived
    std::uint64_t acknowledged_entries = 0;      // over the stream
    std::uint64_t uplink_bytes = 0;              // with 28 bytes of headers each
    std::uint64_t entries_by_stream = 0, refused = 0;
    std::size_t most_waiting = 0;  // bytes unacknowledged
    std::optional<Time> wakes_at;
    bool cutting = false;
    CuttingState state;
  };
  struct Session {
    Session(std::size_t which, const SessionKeys& keys, const TrialOptions& options)
        : link(keys, {10 + which}, seeded(options.seed * 7 + which), 1, 1, options.down) {}
    wire::ServerLink link;
    std::vector<Cut> cuts;                    // in the order of arrival
    std::vector<wire::IndexedEntry> entries;  // as the room sent them
    std::uint64_t streamed_entries = 0;       // the stream has carried these
    std::uint64_t durable = 0, acknowledged = 0;
    std::uint64_t downlink_bytes = 0;
    std::optional<Time> wakes_at;
  };

  explicit Trial(const TrialOptions& options);

  // Moves the client to another address.
  void move_client(std::size_t c, const Endpoint& to);

  // True once every client has taken the log entry of every cut.
  [[nodiscard]] bool settled() const;
  // Runs until settled, or until the timeout. Returns how long it ran.
  Time settle(Time timeout);
  // True if each log entry arrived once, in order, as the room sent it.
  [[nodiscard]] bool exact() const;
  void cut(bool on) {
    for (const auto& client : clients) client->cutting = on;
  }
  // Drops all datagrams in this time. The stream goes on.
  void block(Time from, Time until) { network.partition(from, until); }
  // Drops all datagrams, and holds the stream's messages back until the end of this time.
  void partition(Time from, Time until) {
    network.partition(from, until);
    stream_stops_.push_back({from, until});
  }

  const TrialOptions options_;
  VirtualTime time;
  SimNetwork network;
  Random random_;
  std::unique_ptr<SimPort> server_port;
  std::vector<std::unique_ptr<Client>> clients;
  std::vector<std::unique_ptr<Session>> sessions;
  // Sees each datagram of a client before the network does. True: drop it.
  std::function<bool(std::size_t client, std::span<const std::uint8_t>)> tap;

 private:
  using Action = std::function<void()>;
  void stream(Action there);
  void wake(std::optional<Time>& wakes_at, Time at, Action action);

  void make_cuts(std::size_t c);
  static Digest tool_of(std::uint64_t number);
  static wire::SessionEntry supervised(RoomSeq seq);
  Cut drilling(const Client& client, std::uint64_t number);

  void turn(std::size_t c);

  void receive_server();
  void server_turn(std::size_t c);

  void send_entry(std::size_t c, wire::SessionEntry entry);
  void stream_entry(std::size_t c, std::uint64_t index);

  void tick();
  void make_durable(const std::vector<std::pair<std::size_t, Cut>>& decided, bool event);

  std::uint64_t room_seq_ = 0;
  Time stream_at_{};
  std::vector<std::pair<Time, Time>> stream_stops_;
};

inline PathQuality hostile(Time delay = 100ms) {
  PathQuality bad;
  bad.loss = 0.3;
  bad.reorder = 0.1;
  bad.duplicate = 0.05;
  bad.corrupt = 0.01;
  bad.delay = delay;
  bad.jitter = 10ms;
  return bad;
}

}  // namespace osteon::test
