#include "tests/simulation/sim_link.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/link/sealed.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using Time = VirtualTime::Time;

constexpr int kServersMostInAEntry = 256, kClientsMostInAEntry = 64;
constexpr Time kLongestWait = 100ms;
constexpr auto kWakingTakes_us = 300;  // at most

std::uint64_t hash_of(std::span<const std::uint8_t> bytes) {
  return std::hash<std::string_view>{}({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

FillRandom seeded(std::uint64_t seed) {
  return [random = std::make_shared<Random>(seed)](std::span<std::uint8_t> bytes) {
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random->index(256));
  };
}

}  // namespace

void Alarm::set(Time at) {
  at = std::max(at, time_.now());
  if (*at_ <= at) return;
  *at_ = at;
  time_.post(at, [this, at, set = at_] {
    if (*set != at) return;  // it was set to an earlier time, or is gone
    *set = Time::max();
    ring_();
  });
}

Datagrams::Datagrams(VirtualTime& time, Ledger& ledger, std::uint64_t seed, double forged)
    : time_(time),
      ledger_(ledger),
      random_(seed),
      forged_(forged),
      network_(time, seed + 1),
      forger_(network_.open(node(kForger))) {}

void Datagrams::send(Way way, SimPort& port, const Endpoint& to, std::span<const std::uint8_t> bytes) {
  ++counts_.sent;
  genuine_[way].insert(hash_of(bytes));
  if (way == down)
    ledger_.check(clients_.contains(to) || to == forger_->local(), Invariant::datagrams,
                  "the room sends to where nobody ever was");
  port.send(to, bytes);
  if (to == forger_->local()) {
    to_forger_bytes_ += bytes.size();
    return ledger_.check(to_forger_bytes_ <= PathRules{}.most_sent * from_forger_bytes_, Invariant::datagrams,
                         "somebody who proves nothing is sent more than thrice what he sent");
  }
  if (random_.unit() >= forged_) return;
  const Time later = Time(static_cast<std::int64_t>(random_.unit() * random_.unit() * 1e9));
  time_.post_in(
      later, [this, from = port.local(), to, copy = std::vector<std::uint8_t>(bytes.begin(), bytes.end())]() mutable {
        forge(from, to, std::move(copy));
      });
}

void Datagrams::opened(Way way, std::span<const std::uint8_t> bytes) {
  ++counts_.opened;
  ledger_.check(genuine_[way].erase(hash_of(bytes)) == 1, Invariant::datagrams,
                "a datagram was taken for authentic that nobody has sealed, or that had come before");
}

// Sends a datagram again that was seen on its way. It may be changed, or have another sender or receiver.
void Datagrams::forge(const Endpoint& from, const Endpoint& to, std::vector<std::uint8_t> bytes) {
  ++counts_.forged;
  const auto flip = [&](std::size_t first, std::size_t end) {
    bytes[first + random_.index(end - first)] ^= static_cast<std::uint8_t>(1u << random_.index(8));
  };
  switch (random_.index(6)) {
    case 0:
      break;  // unchanged
    case 1:
      flip(0, bytes.size());
      break;
    case 2:
      flip(4, 13);
      break;  // another key or counter
    case 3:
      bytes.resize(1 + random_.index(bytes.size()));
      break;
    case 4:
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random_.index(256));
      break;
    default:
      return network_.send(to, from, bytes);  // back to its sender
  }
  const bool own_name = random_.unit() < 0.5;
  if (own_name && to == node(kServer)) from_forger_bytes_ += bytes.size();
  network_.send(own_name ? forger_->local() : from, to, bytes);
}

SimLinks::SimLinks(Datagrams& datagrams, std::uint64_t seed, const wire::LinkOptions& options,
                   std::function<bool()> silent)
    : datagrams_(datagrams),
      random_(seed),
      options_(options),
      silent_(std::move(silent)),
      port_(datagrams.network().open(node(Datagrams::kServer))),
      alarm_(datagrams.time(), [this] { turn(); }) {
  port_->on_arrival([this] { alarm_.set(datagrams_.time().now()); });
}

std::shared_ptr<SimLinks::Link> SimLinks::add(AuthorId author, std::uint64_t first_author_seq, Receiver& sink) {
  std::uint32_t session = 0;
  while (session == 0 || links_.contains(session)) session = static_cast<std::uint32_t>(random_.index(1u << 31));
  const auto link = std::make_shared<Link>(*this, make_session_keys(session, seeded(random_.index(1u << 30))), author,
                                           first_author_seq, sink);
  links_[session] = link;
  return link;
}

void SimLinks::remove(const std::shared_ptr<Link>& link) {
  links_.erase(link->keys().session);
  link->sink_ = nullptr;
}

void SimLinks::receive_some() {
  DatagramBuffer buffer;
  for (int i = 0; i < kServersMostInAEntry; ++i) {
    const std::optional<Datagram> datagram = port_->receive(buffer);
    if (!datagram) return;
    const std::optional<std::uint32_t> session = session_of(datagram->bytes);
    const auto found = session ? links_.find(*session) : links_.end();
    if (found == links_.end()) continue;
    const std::shared_ptr<Link> link = found->second;
    const std::uint64_t before = link->link_.half().open_counts().opened;
    link->link_.receive(datagram->from, datagram->bytes, datagrams_.time().now());
    if (link->link_.half().open_counts().opened != before) datagrams_.opened(Datagrams::up, datagram->bytes);
    datagrams_.ledger().check(link->link_.half().counts().malformed == 0, Invariant::datagrams,
                              "a client's datagram makes no sense");
    datagrams_.ledger().check(link->link_.address() != node(Datagrams::kForger), Invariant::datagrams,
                              "a client is believed to be where somebody else is");
    datagrams_.counts().moves += link->link_.moves() - std::exchange(link->moves_, link->link_.moves());
    datagrams_.counts().cuts += link->say_news();
  }
}

void SimLinks::turn() {
  if (silent_()) return;
  receive_some();
  const Time now = datagrams_.time().now();
  Time next = now + kLongestWait;
  DatagramBuffer buffer;
  for (const auto& [session, link] : links_) {
    while (const std::optional<wire::ServerLink::Out> out = link->link_.send(now, buffer))
      datagrams_.send(Datagrams::down, *port_, out->to, out->bytes);
    next = std::min(next, link->link_.next(now));
  }
  if (!links_.empty()) alarm_.set(next);
}

SimLinks::Link::Link(SimLinks& links, const SessionKeys& keys, AuthorId author, std::uint64_t first_author_seq,
                     Receiver& sink)
    : links_(links),
      keys_(keys),
      sink_(&sink),
      link_(keys, author, seeded(links.random_.index(1u << 30)), first_author_seq, 1, links.options_) {}

std::size_t SimLinks::Link::say_news() {
  std::vector<Cut> cuts;
  while (std::optional<Cut> cut = link_.take_cut()) cuts.push_back(std::move(*cut));
  const std::optional<wire::KnownToolState> state = link_.take_state();
  if (state) {
    links_.datagrams_.ledger().check(state->state.state_seq > state_seq_, Invariant::datagrams,
                                     "an old state of a tool replaced a new one");
    state_seq_ = state->state.state_seq;
  }
  if (!sink_) return 0;
  for (Cut& cut : cuts) sink_->take(std::move(cut));
  if (state) sink_->take(state->state);
  if (link_.acknowledged() > arrived_) sink_->arrived(arrived_ = link_.acknowledged());
  return cuts.size();
}

void SimLinks::Link::insert(const Cut& cut) {
  link_.insert(cut);
  say_news();
}

bool SimLinks::Link::enqueue(std::uint64_t index, const wire::SessionEntry& entry) {
  const Time now = links_.datagrams_.time().now();
  const bool goes = link_.enqueue(index, entry) && link_.alive(now);
  links_.alarm_.set(now + std::chrono::microseconds(static_cast<int>(links_.random_.index(kWakingTakes_us))));
  return goes;
}

SimFastPath::SimFastPath(Datagrams& datagrams, std::uint64_t seed, const Endpoint& at, const SessionKeys& keys,
                         std::uint64_t first_author_seq, const wire::LinkOptions& options, Time ahead, Hears hears)
    : datagrams_(datagrams),
      random_(seed),
      ahead_(ahead),
      hears_(std::move(hears)),
      link_(keys, first_author_seq, 1, options),
      pushed_(first_author_seq - 1),
      alarm_(datagrams.time(), [this] { turn(); }) {
  move(at);
}

void SimFastPath::move(const Endpoint& to) {
  port_ = datagrams_.network().open(to);
  datagrams_.client_is_at(to);
  port_->on_arrival([this] { alarm_.set(datagrams_.time().now()); });
  wake();
}

void SimFastPath::wake() {
  alarm_.set(datagrams_.time().now() + std::chrono::microseconds(static_cast<int>(random_.index(kWakingTakes_us))));
}

bool SimFastPath::send(const Cut& cut) {
  bool goes = false;
  if (cut.author_seq > pushed_) {
    pushed_ = cut.author_seq;
    goes = link_.push(cut) && link_.alive(now());
  }
  wake();
  return goes;
}

void SimFastPath::send(const CuttingState& state) { link_.set_state(state, 0); }

void SimFastPath::received(std::uint64_t index) { link_.received(index); }

void SimFastPath::turn() {
  DatagramBuffer buffer;
  for (int i = 0; i < kClientsMostInAEntry; ++i) {
    const std::optional<Datagram> datagram = port_->receive(buffer);
    if (!datagram) break;
    const std::uint64_t before = link_.half().open_counts().opened;
    link_.receive(datagram->bytes, now());
    if (link_.half().open_counts().opened != before) datagrams_.opened(Datagrams::down, datagram->bytes);
  }
  Ledger& ledger = datagrams_.ledger();
  ledger.check(link_.half().counts().malformed == 0, Invariant::datagrams, "the room's datagram makes no sense");
  if (const std::optional<ClockReading> clock = link_.clock(now()))
    // Times are sent in microseconds.
    ledger.check(std::chrono::abs(clock->offset + ahead_) <= clock->error + 2us, Invariant::datagrams,
                 "the server's clock is not where it was measured");
  std::vector<wire::IndexedEntry> entries;
  while (std::optional<wire::IndexedEntry> entry = link_.take_entry()) entries.push_back(std::move(*entry));
  if (const auto bytes = link_.send(now(), buffer); !bytes.empty())
    datagrams_.send(Datagrams::up, *port_, node(Datagrams::kServer), bytes);
  alarm_.set(datagrams_.time().now() + std::clamp(link_.next(now()) - now(), Time{0}, kLongestWait));
  const bool died = std::exchange(was_alive_, link_.alive(now())) && !was_alive_;
  for (wire::IndexedEntry& entry : entries) hears_.entry(std::move(entry));
  if (died) hears_.dead();
}

}  // namespace osteon::test
