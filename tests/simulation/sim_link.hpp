// The fast path on virtual time. It does what haptic_client/net/fast_path.cpp and server/rpc/link_server.cpp do between
// sockets and the two links, over a simulated network with a forger on the way.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <unordered_set>
#include <vector>

#include "common/wire/client_link.hpp"
#include "common/wire/server_link.hpp"
#include "server/rpc/link_server.hpp"
#include "tests/simulation/ledger.hpp"
#include "tests/support/network/sim_network.hpp"

namespace osteon::test {

// Rings once, at the earliest time that was set since it last rang.
class Alarm {
 public:
  using Time = VirtualTime::Time;
  Alarm(VirtualTime& time, std::function<void()> ring) : time_(time), ring_(std::move(ring)) {}
  ~Alarm() { *at_ = Time::min(); }
  Alarm(const Alarm&) = delete;
  Alarm& operator=(const Alarm&) = delete;
  void set(Time at);

 private:
  VirtualTime& time_;
  const std::function<void()> ring_;
  std::shared_ptr<Time> at_ = std::make_shared<Time>(Time::max());  // shared with posted actions
};

struct DatagramCounts {
  std::uint64_t sent = 0, opened = 0, forged = 0;
  std::uint64_t entries = 0, cuts = 0;  // delivered by datagrams
  std::uint64_t moves = 0;              // addresses that were verified
};

// All datagrams of a simulation. Whatever an end accepts as authentic must be something that the other end has sealed,
// and only once.
class Datagrams {
 public:
  enum Way { up, down };
  static constexpr std::uint64_t kServer = 1000, kForger = 666;  // nodes

  // `forged`: share of the datagrams that the forger sees and sends on in another way.
  Datagrams(VirtualTime& time, Ledger& ledger, std::uint64_t seed, double forged);

  [[nodiscard]] VirtualTime& time() { return time_; }
  [[nodiscard]] SimNetwork& network() { return network_; }
  [[nodiscard]] DatagramCounts& counts() { return counts_; }
  [[nodiscard]] Ledger& ledger() { return ledger_; }
  void send(Way way, SimPort& port, const Endpoint& to, std::span<const std::uint8_t> bytes);
  void opened(Way way, std::span<const std::uint8_t> bytes);
  void client_is_at(const Endpoint& address) { clients_.insert(address); }
  void rest() { forged_ = 0; }

 private:
  void forge(const Endpoint& from, const Endpoint& to, std::vector<std::uint8_t> bytes);

  VirtualTime& time_;
  Ledger& ledger_;
  Random random_;
  double forged_;
  SimNetwork network_;
  std::unique_ptr<SimPort> forger_;
  std::uint64_t from_forger_bytes_ = 0, to_forger_bytes_ = 0;  // to the room, and from it
  std::array<std::unordered_set<std::uint64_t>, 2> genuine_;   // not opened yet
  std::set<Endpoint> clients_;
  DatagramCounts counts_;
};

// The room's end of all fast paths: LinkServer, with SessionLink.
class SimLinks {
 public:
  using Time = VirtualTime::Time;
  using Receiver = SessionLink::Receiver;
  class Link;

  // `silent`: the process does not run any more, though it is not gone yet.
  SimLinks(Datagrams& datagrams, std::uint64_t seed, const wire::LinkOptions& options, std::function<bool()> silent);
  [[nodiscard]] std::shared_ptr<Link> add(AuthorId author, std::uint64_t first_author_seq, Receiver& sink);
  void remove(const std::shared_ptr<Link>& link);

 private:
  void turn();
  void receive_some();

  Datagrams& datagrams_;
  Random random_;
  const wire::LinkOptions options_;
  const std::function<bool()> silent_;
  std::unique_ptr<SimPort> port_;
  std::map<std::uint32_t, std::shared_ptr<Link>> links_;
  Alarm alarm_;
};

// The link of one session.
class SimLinks::Link {
 public:
  Link(SimLinks& links, const SessionKeys& keys, AuthorId author, std::uint64_t first_author_seq, Receiver& sink);
  [[nodiscard]] const SessionKeys& keys() const { return keys_; }
  void insert(const Cut& cut);
  // False: it is sent over the stream only, because it does not fit or the client cannot be reached.
  bool enqueue(std::uint64_t index, const wire::SessionEntry& entry);
  void know_tool(std::uint32_t number, const Digest& tool) { link_.tools().add(number, tool); }

 private:
  friend class SimLinks;
  std::size_t say_news();  // number of cuts in it

  SimLinks& links_;
  const SessionKeys keys_;
  Receiver* sink_;
  wire::ServerLink link_;
  std::uint64_t arrived_ = 0, moves_ = 0, state_seq_ = 0;
};

// The client's end for one stream: FastPath.
class SimFastPath {
 public:
  using Time = VirtualTime::Time;
  struct Hears {  // neither ends the path
    std::function<void(wire::IndexedEntry)> entry;
    std::function<void()> dead;
  };

  // `ahead`: of the server's clock.
  SimFastPath(Datagrams& datagrams, std::uint64_t seed, const Endpoint& at, const SessionKeys& keys,
              std::uint64_t first_author_seq, const wire::LinkOptions& options, Time ahead, Hears hears);
  [[nodiscard]] bool send(const Cut& cut);
  void send(const CuttingState& state);
  void received(std::uint64_t index);
  void decided(std::uint64_t author_seq) { link_.acknowledge(author_seq); }
  void know_tool(std::uint32_t number, const Digest& tool) { link_.tools().add(number, tool); }
  void move(const Endpoint& to);
  [[nodiscard]] bool alive() const { return link_.alive(now()); }

 private:
  void turn();
  void wake();
  [[nodiscard]] Time now() const { return datagrams_.time().now() + ahead_; }

  Datagrams& datagrams_;
  Random random_;
  const Time ahead_;
  const Hears hears_;
  wire::ClientLink link_;
  std::uint64_t pushed_;
  bool was_alive_ = false;
  std::unique_ptr<SimPort> port_;
  Alarm alarm_;
};

}  // namespace osteon::test
