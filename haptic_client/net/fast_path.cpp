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
                                                 std::uint64_t first_author_seq, FastPathEvents events) {
  const Result<Endpoint> server = find_endpoint(host, port);
  if (!server) return tl::unexpected(server.error());
  const bool v4 = server->high == 0 && server->low >> 32 == 0xffff;
  Result<std::unique_ptr<UdpPort>> socket = UdpPort::open({.address = v4 ? "0.0.0.0" : "::"});
  if (!socket) return tl::unexpected(socket.error());
  return std::unique_ptr<FastPath>(
      new FastPath(std::move(*socket), *server, keys, first_author_seq, std::move(events)));
}

FastPath::FastPath(std::unique_ptr<UdpPort> port, const Endpoint& server, const SessionKeys& keys,
                   std::uint64_t first_author_seq, FastPathEvents events)
    : port_(std::move(port)),
      server_(server),
      events_(std::move(events)),
      link_(keys, first_author_seq),
      pushed_(first_author_seq - 1) {
  thread_ = std::thread([this] { run(); });
}

FastPath::~FastPath() { stop(); }

void FastPath::stop() {
  {
    const MutexLock lock(mutex_);
    end_ = true;
  }
  port_->wake();
  if (thread_.joinable()) thread_.join();
}

bool FastPath::send(const Cut& cut) {
  bool goes = false;
  {
    const MutexLock lock(mutex_);
    // A cut that was sent before and is sent again was not acknowledged: now the stream sends it.
    if (cut.author_seq > pushed_) {
      pushed_ = cut.author_seq;
      goes = link_.push(cut) && link_.alive(now_of_links());
    }
  }
  port_->wake();
  return goes;
}

bool FastPath::send(const CuttingState& state) {
  const MutexLock lock(mutex_);
  link_.set_state(state, 0);
  return link_.alive(now_of_links());
}

bool FastPath::send(const MountLoad& push) {
  bool goes = false;
  {
    const MutexLock lock(mutex_);
    link_.set_push(push);
    goes = link_.alive(now_of_links());
  }
  port_->wake();
  return goes;
}

void FastPath::received(std::uint64_t index) {
  const MutexLock lock(mutex_);
  link_.received(index);
}

void FastPath::decided(std::uint64_t author_seq) {
  const MutexLock lock(mutex_);
  link_.acknowledge(author_seq);
}

void FastPath::know_tool(std::uint32_t number, const Digest& tool) {
  const MutexLock lock(mutex_);
  link_.tools().add(number, tool);
}

FastPathHealth FastPath::health() const {
  const MutexLock lock(mutex_);
  const Time now = now_of_links();
  const wire::LinkCounts& counts = link_.half().counts();
  FastPathHealth health{.offered = true,
                        .alive = link_.alive(now),
                        .loss = link_.loss(),
                        .packets_sent = counts.packets_sent,
                        .bytes_sent = counts.bytes_sent,
                        .packets_received = counts.packets_received,
                        .bytes_received = counts.bytes_received};
  if (const std::optional<ClockReading> clock = link_.clock(now))
    health.round_trip_ms = 1e-6 * static_cast<double>(clock->round_trip.count());
  return health;
}

void FastPath::take_partners(Time now, std::vector<CuttingState>& newer) {
  for (const wire::KnownToolState& known : link_.partners(now)) {
    std::uint64_t& newest_seq = partners_[known.state.author];
    if (known.state.state_seq <= newest_seq) continue;
    newest_seq = known.state.state_seq;
    newer.push_back(known.state);
  }
}

void FastPath::run() {
  DatagramBuffer buffer;
  std::vector<wire::IndexedEntry> entries;
  std::vector<CuttingState> partners;
  bool was_alive = false, was_frozen = false;
  std::uint64_t was_epoch = 0;
  while (true) {
    Time wait = kLongestWait;
    bool died = false, frozen = false, came = false;
    std::uint64_t epoch = 0;
    std::optional<MountPose> bone;
    {
      const MutexLock lock(mutex_);
      if (end_) return;
      for (int i = 0; i < kMostInARow; ++i) {
        const std::optional<Datagram> datagram = port_->receive(buffer);
        if (!datagram) break;
        link_.receive(datagram->bytes, now_of_links());
        came = true;
      }
      frozen = link_.frozen();
      epoch = link_.lease_epoch();
      bone = link_.take_bone();
      if (came && events_.partner) take_partners(now_of_links(), partners);
      while (std::optional<wire::IndexedEntry> entry = link_.take_entry()) entries.push_back(std::move(*entry));
      const Time now = now_of_links();
      if (const auto bytes = link_.send(now, buffer); !bytes.empty()) port_->send(server_, bytes);
      wait = std::clamp(link_.next(now) - now, Time{0}, kLongestWait);
      died = was_alive && !link_.alive(now);
      was_alive = link_.alive(now);
    }
    // Before all calls that may have to wait.
    if ((frozen != was_frozen || epoch != was_epoch) && events_.stop_flag) events_.stop_flag(epoch, frozen);
    was_frozen = frozen;
    was_epoch = epoch;
    if (bone && events_.bone) events_.bone(*bone);
    for (wire::IndexedEntry& entry : entries) events_.entry(std::move(entry));
    entries.clear();
    for (const CuttingState& partner : partners) events_.partner(partner);
    partners.clear();
    if (died) events_.dead();
    port_->wait(wait);
  }
}

}  // namespace osteon
