#include "haptic_client/net/fast_path.hpp"

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

namespace osteon {
namespace {

using Time = std::chrono::nanoseconds;
using namespace std::chrono_literals;

constexpr int kMostInARow = 64;  // datagrams received before one is sent
constexpr Time kLongestWait = 100ms;

// The clock of all links of this process.
Time now_of_links() {
  static const auto start = std::chrono::steady_clock::now();
  return std::chrono::steady_clock::now() - start;
}

}  // namespace

Result<std::unique_ptr<FastPath>> FastPath::open(const std::string& host, std::uint16_t port, const SessionKeys& keys,
                                                 std::uint64_t first_author_seq, std::function<void(wire::IndexedRow)> row,
                                                 std::function<void()> dead) {
  const Result<Endpoint> server = find_endpoint(host, port);
  if (!server) return tl::unexpected(server.error());
  const bool v4 = server->high == 0 && server->low >> 32 == 0xffff;
  Result<std::unique_ptr<UdpPort>> socket = UdpPort::open({.address = v4 ? "0.0.0.0" : "::"});
  if (!socket) return tl::unexpected(socket.error());
  return std::unique_ptr<FastPath>(
      new FastPath(std::move(*socket), *server, keys, first_author_seq, std::move(row), std::move(dead)));
}

FastPath::FastPath(std::unique_ptr<UdpPort> port, const Endpoint& server, const SessionKeys& keys, std::uint64_t first_author_seq,
                   std::function<void(wire::IndexedRow)> row, std::function<void()> dead)
    : port_(std::move(port)), server_(server), row_(std::move(row)), dead_(std::move(dead)), link_(keys, first_author_seq),
      pushed_(first_author_seq - 1) {
  thread_ = std::thread([this] { run(); });
}

FastPath::~FastPath() { stop(); }

void FastPath::stop() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  port_->wake();
  if (thread_.joinable()) thread_.join();
}

bool FastPath::send(const Cut& cut) {
  bool goes = false;
  {
    const std::lock_guard lock(mutex_);
    // One that went before and is sent again was not acknowledged: it is the stream's turn.
    if (cut.author_seq > pushed_) {
      pushed_ = cut.author_seq;
      goes = link_.push(cut) && link_.alive(now_of_links());
    }
  }
  port_->wake();
  return goes;
}

bool FastPath::send(const CuttingState& state) {
  const std::lock_guard lock(mutex_);
  link_.set_state(state, 0);
  return link_.alive(now_of_links());
}

void FastPath::heard(std::uint64_t index) {
  const std::lock_guard lock(mutex_);
  link_.heard(index);
}

void FastPath::decided(std::uint64_t author_seq) {
  const std::lock_guard lock(mutex_);
  link_.acknowledge(author_seq);
}

void FastPath::know_tool(std::uint32_t number, const Digest& tool) {
  const std::lock_guard lock(mutex_);
  link_.tools().add(number, tool);
}

FastPathHealth FastPath::health() const {
  const std::lock_guard lock(mutex_);
  const Time now = now_of_links();
  const wire::LinkCounts& counts = link_.half().counts();
  FastPathHealth health{.offered = true, .alive = link_.alive(now), .loss = link_.loss(),
                        .packets_sent = counts.packets_sent, .bytes_sent = counts.bytes_sent,
                        .packets_received = counts.packets_received, .bytes_received = counts.bytes_received};
  if (const std::optional<ClockReading> clock = link_.clock(now))
    health.round_trip_ms = 1e-6 * static_cast<double>(clock->round_trip.count());
  return health;
}

void FastPath::run() {
  DatagramBuffer buffer;
  std::vector<wire::IndexedRow> rows;
  bool was_alive = false;
  while (true) {
    Time wait = kLongestWait;
    bool died = false;
    {
      const std::lock_guard lock(mutex_);
      if (end_) return;
      for (int i = 0; i < kMostInARow; ++i) {
        const std::optional<Datagram> datagram = port_->receive(buffer);
        if (!datagram) break;
        link_.receive(datagram->bytes, now_of_links());
      }
      while (std::optional<wire::IndexedRow> row = link_.take_row()) rows.push_back(std::move(*row));
      const Time now = now_of_links();
      if (const auto bytes = link_.send(now, buffer); !bytes.empty()) port_->send(server_, bytes);
      wait = std::clamp(link_.next(now) - now, Time{0}, kLongestWait);
      died = was_alive && !link_.alive(now);
      was_alive = link_.alive(now);
    }
    for (wire::IndexedRow& row : rows) row_(std::move(row));
    rows.clear();
    if (died) dead_();
    port_->wait(wait);
  }
}

}  // namespace osteon
