#include "tests/simulation/sim_stream.hpp"

#include <algorithm>

namespace osteon::test {

using namespace std::chrono_literals;

bool SimPath::cut_off(Time at) const {
  return std::ranges::any_of(partitions_, [&](const auto& one) { return at >= one.first && at < one.second; });
}

void SimPath::heal() {
  for (auto& [from, until] : partitions_) until = std::min(until, time_.now());
}

std::optional<VirtualTime::Time> SimPath::arrival() {
  const Time now = time_.now();
  Time sent = now;
  for (Time again = 200ms; sent - now <= kPatience; sent += again, again *= 2) {
    const bool lost = random_.unit() < condition_.loss;
    const Time delay = drawn(random_, condition_.delay - condition_.jitter, condition_.delay + condition_.jitter);
    if (!lost && !cut_off(sent)) return sent + std::max(Time{}, delay);
  }
  return std::nullopt;
}

void SimStream::write(End from, std::string message) {
  if (over_) return;
  Side& side = ends_[from];
  const std::optional<Time> at = path_.arrival();
  side.under_way += message.size();
  if (!at) {
    // TCP gives up; until then neither end knows.
    path_.time().post_in(SimPath::kPatience,
                         [self = shared_from_this()] { self->lose("the connection has timed out"); });
    side.last = Time::max();
  }
  if (side.last == Time::max()) return;
  side.last = std::max(*at, side.last);
  path_.time().post(side.last, [self = shared_from_this(), to = other(from), bytes = std::move(message)]() mutable {
    self->arrive(to, std::move(bytes));
  });
}

void SimStream::arrive(End to, std::string message) {
  Side& side = ends_[to];
  if (path_.time().now() >= side.lost_from) return;
  side.unread.push_back(std::move(message));
  pass_on(to);
}

void SimStream::pass_on(End to) {
  Side &side = ends_[to], &writer = ends_[other(to)];
  while (side.reads && !side.unread.empty()) {
    const std::string message = std::move(side.unread.front());
    side.unread.pop_front();
    const bool was_full = writer.under_way >= window_bytes_;
    writer.under_way -= message.size();
    if (was_full)
      path_.time().post_in(path_.delay(), [self = shared_from_this(), end = other(to)] {
        if (!self->over_ && self->ends_[end].hears.writable) self->ends_[end].hears.writable();
      });
    if (const auto hears = side.hears.message) hears(message);
  }
}

void SimStream::read_on(End end) {
  ends_[end].reads = true;
  path_.time().post_in(0ns, [self = shared_from_this(), end] { self->pass_on(end); });
}

void SimStream::tell_ended(End end, Time at, const Ending& ending) {
  path_.time().post(at, [self = shared_from_this(), end, ending] {
    Side& side = self->ends_[end];
    if (std::exchange(side.told, true)) return;
    const auto ended = side.hears.ended;
    side.hears = {};
    if (ended) ended(ending);
  });
}

void SimStream::finish(const Ending& ending) {
  if (over_) return;
  over_ = true;
  ends_[server].told = true;
  ends_[server].hears = {};
  if (ends_[server].last == Time::max())
    return tell_ended(client, path_.time().now() + SimPath::kPatience, {false, "timed out"});
  const std::optional<Time> at = path_.arrival();
  if (at)
    tell_ended(client, std::max(*at, ends_[server].last), ending);
  else
    tell_ended(client, path_.time().now() + SimPath::kPatience, {false, "the connection has timed out"});
}

void SimStream::leave(End end) {
  over_ = true;
  ends_[end].told = true;
  ends_[end].hears = {};
  Random& random = path_.random();
  const Time now = path_.time().now();
  // When a process is killed, its system closes its connections at once. After a power failure it sends nothing.
  const Time heard = random.unit() < 0.5 ? path_.delay() : drawn(random, 0ns, 2s);
  tell_ended(other(end), now + heard, {false, "the connection was closed"});
  if (random.unit() < 0.5) ends_[other(end)].lost_from = now + drawn(random, 0ns, 100ms);
}

void SimStream::break_off(const std::string& why) {
  if (!over_) lose(why);
}

void SimStream::lose(const std::string& why) {
  if (over_) return;
  over_ = true;
  ++broken_;
  Random& random = path_.random();
  const Time now = path_.time().now();
  for (const End end : {client, server}) {
    // Data in transit may still arrive after the other end has given up.
    if (random.unit() < 0.7) ends_[end].lost_from = now + drawn(random, 0ns, 50ms);
    const Time most = random.unit() < 0.5 ? Time{50ms} : end == client ? Time{3s} : Time{12s};
    tell_ended(end, now + drawn(random, 0ns, most), {false, why});
  }
}

}  // namespace osteon::test
