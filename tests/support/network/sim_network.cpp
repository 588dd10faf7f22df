#include "tests/support/network/sim_network.hpp"

#include <algorithm>

#include "common/core/check.hpp"

namespace osteon::test {
namespace {

// Sebastiano Vigna's splitmix64: neighbouring inputs give unrelated seeds.
std::uint64_t mix(std::uint64_t seed, std::uint64_t value) {
  std::uint64_t z = seed + 0x9e3779b97f4a7c15 * (value + 1);
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
  z = (z ^ z >> 27) * 0x94d049bb133111eb;
  return z ^ z >> 31;
}

std::uint64_t mix(std::uint64_t seed, const Endpoint& e) { return mix(mix(mix(seed, e.high), e.low), e.port); }

}  // namespace

std::unique_ptr<SimPort> SimNetwork::open(const Endpoint& at) { return std::make_unique<SimPort>(*this, at); }

void SimNetwork::set_quality(const PathQuality& everywhere) {
  everywhere_ = everywhere;
  for (auto& [ends, path] : paths_) path.set(everywhere);
}

void SimNetwork::set_quality(const Endpoint& from, const Endpoint& to, const PathQuality& one_direction) {
  path(from, to).set(one_direction);
}

void SimNetwork::partition(Time from, Time until) { partitions_.push_back({{}, {}, from, until}); }

void SimNetwork::partition(const Endpoint& a, const Endpoint& b, Time from, Time until) {
  partitions_.push_back({a, b, from, until});
}

Impairment& SimNetwork::path(const Endpoint& from, const Endpoint& to) {
  const auto [at, made] = paths_.try_emplace({from, to}, mix(mix(seed_, from), to));
  if (made) at->second.set(everywhere_);
  return at->second;
}

bool SimNetwork::cut_off(const Endpoint& from, const Endpoint& to) const {
  return std::ranges::any_of(partitions_, [&](const Partition& p) {
    const bool concerned = !p.a.is_set() || (p.a == from && p.b == to) || (p.a == to && p.b == from);
    return concerned && now() >= p.from && now() < p.until;
  });
}

void SimNetwork::send(const Endpoint& from, const Endpoint& to, std::span<const std::uint8_t> bytes) {
  OSTEON_CHECK(bytes.size() <= kMostDatagramBytes);
  ++counts_.sent;
  counts_.sent_bytes += bytes.size();
  if (cut_off(from, to)) {
    ++counts_.cut_off;
    return;
  }
  Impairment& fate = path(from, to);
  for (const Impairment::Copy& copy : fate.pass(now(), bytes.size())) {
    std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
    if (copy.spoiled) fate.spoil(data);
    time_.post(copy.at, [this, from, to, data = std::move(data)]() mutable { arrive(from, to, std::move(data)); });
  }
}

void SimNetwork::arrive(const Endpoint& from, const Endpoint& to, std::vector<std::uint8_t> bytes) {
  const auto port = ports_.find(to);
  if (port == ports_.end()) {
    ++counts_.unreachable;
    return;
  }
  SimPort& there = *port->second;
  if (there.waiting_.size() >= SimPort::kMostWaiting) {
    ++counts_.crowded_out;
    return;
  }
  ++counts_.delivered;
  there.waiting_.emplace_back(from, std::move(bytes));
  if (there.wake_) there.wake_();
}

NetworkCounts SimNetwork::counts() const {
  NetworkCounts all = counts_;
  for (const auto& [ends, path] : paths_) {
    all.paths.given += path.counts().given;
    all.paths.lost += path.counts().lost;
    all.paths.overflowed += path.counts().overflowed;
    all.paths.duplicated += path.counts().duplicated;
    all.paths.held_back += path.counts().held_back;
    all.paths.corrupted += path.counts().corrupted;
  }
  return all;
}

SimPort::SimPort(SimNetwork& network, const Endpoint& at) : network_(network), local_(at) {
  OSTEON_CHECK(at.is_set());
  const bool free = network_.ports_.emplace(at, this).second;
  OSTEON_CHECK(free);
}

SimPort::~SimPort() { network_.ports_.erase(local_); }

std::optional<Datagram> SimPort::receive(std::span<std::uint8_t> into) {
  if (waiting_.empty()) return {};
  const auto [from, bytes] = std::move(waiting_.front());
  waiting_.pop_front();
  OSTEON_CHECK(into.size() >= bytes.size());
  std::ranges::copy(bytes, into.begin());
  return Datagram{from, into.first(bytes.size())};
}

}  // namespace osteon::test
