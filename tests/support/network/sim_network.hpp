// A network on virtual time. It loses, delays, repeats, reorders and spoils datagrams by a seed. One thread.
#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/link/datagram.hpp"
#include "tests/support/network/impairment.hpp"
#include "tests/support/network/virtual_time.hpp"

namespace osteon::test {

// The n-th node of a simulation, from 1.
[[nodiscard]] inline Endpoint node(std::uint64_t n, std::uint16_t port = 1) { return {0, n, port}; }

struct NetworkCounts {
  std::uint64_t sent = 0, sent_bytes = 0;
  std::uint64_t cut_off = 0;      // lost to a partition
  std::uint64_t unreachable = 0;  // no socket at that endpoint when they arrived
  std::uint64_t crowded_out = 0;  // the receiver had too many waiting
  std::uint64_t delivered = 0;
  ImpairmentCounts paths;  // of all directions together
};

class SimPort;

class SimNetwork {
 public:
  using Time = VirtualTime::Time;

  // `time` must outlive the network. The network must exist until everything posted before is run.
  SimNetwork(VirtualTime& time, std::uint64_t seed) : time_(time), seed_(seed) {}
  SimNetwork(const SimNetwork&) = delete;
  SimNetwork& operator=(const SimNetwork&) = delete;

  // A socket at that endpoint, closed by its destructor. It must not outlive the network. One at a time for each
  // endpoint.
  [[nodiscard]] std::unique_ptr<SimPort> open(const Endpoint& at);

  void set_quality(const PathQuality& everywhere);
  void set_quality(const Endpoint& from, const Endpoint& to, const PathQuality& one_direction);
  // Datagrams sent in [from, until) are lost: all, or those between the two in both directions.
  void partition(Time from, Time until);
  void partition(const Endpoint& a, const Endpoint& b, Time from, Time until);

  void send(const Endpoint& from, const Endpoint& to, std::span<const std::uint8_t> bytes);
  [[nodiscard]] Time now() const { return time_.now(); }
  [[nodiscard]] NetworkCounts counts() const;

 private:
  friend class SimPort;
  struct Partition {
    Endpoint a, b;  // not set: everyone
    Time from, until;
  };
  Impairment& path(const Endpoint& from, const Endpoint& to);
  [[nodiscard]] bool cut_off(const Endpoint& from, const Endpoint& to) const;
  void arrive(const Endpoint& from, const Endpoint& to, std::vector<std::uint8_t> bytes);

  VirtualTime& time_;
  std::uint64_t seed_;
  PathQuality everywhere_;
  std::map<std::pair<Endpoint, Endpoint>, Impairment> paths_;  // by direction; each has its own random numbers
  std::vector<Partition> partitions_;
  std::map<Endpoint, SimPort*> ports_;
  NetworkCounts counts_;
};

class SimPort final : public DatagramPort {
 public:
  static constexpr std::size_t kMostWaiting = 4096;  // datagrams that have arrived and were not read

  SimPort(SimNetwork& network, const Endpoint& at);
  ~SimPort() override;
  SimPort(const SimPort&) = delete;
  SimPort& operator=(const SimPort&) = delete;

  void send(const Endpoint& to, std::span<const std::uint8_t> bytes) override { network_.send(local_, to, bytes); }
  std::optional<Datagram> receive(std::span<std::uint8_t> into) override;
  [[nodiscard]] Endpoint local() const override { return local_; }
  // Called after each arrival, at its time. The function may send and receive.
  void on_arrival(std::function<void()> wake) { wake_ = std::move(wake); }

 private:
  friend class SimNetwork;
  SimNetwork& network_;
  Endpoint local_;
  std::deque<std::pair<Endpoint, std::vector<std::uint8_t>>> waiting_;
  std::function<void()> wake_;
};

}  // namespace osteon::test
