#include "tests/unit/wire/forgery.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "common/core/check.hpp"
#include "common/wire/client_link.hpp"
#include "common/wire/server_link.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using Time = std::chrono::nanoseconds;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kPeers = 4, kMoveEvery = 500;
constexpr std::uint64_t kForgedForEachGenuine = 31;
constexpr Time kBetween = 50us, kCut = 8ms, kRest = 500ms;
constexpr std::uint64_t kRekeyPackets = 700;  // so that keys change often

FillRandom seeded_bytes(std::uint64_t seed) {
  return [random = std::make_shared<std::mt19937_64>(seed)](std::span<std::uint8_t> into) {
    for (auto& byte : into) byte = static_cast<std::uint8_t>((*random)());
  };
}

wire::LinkOptions rekeyed(wire::LinkOptions options) {
  options.seal.rekey_packets = kRekeyPackets;
  return options;
}

using Sent = std::vector<std::pair<Endpoint, Bytes>>;

// One session as the server keeps it, with its owner. The owner commits each cut at once and sends its log entry.
class ServerEnd {
 public:
  ServerEnd(const SessionKeys& keys, AuthorId author)
      : author_(author), link(keys, author, seeded_bytes(keys.session), 1, 1, rekeyed(wire::server_link_options())) {}

  // Takes all that the link holds for its owner. Returns how much that was.
  std::uint64_t take(bool decide) {
    std::uint64_t taken = link.take_state().has_value() ? 1 : 0;
    taken += link.take_push().has_value() ? 1 : 0;
    while (const std::optional<Cut> cut = link.take_cut()) {
      ++taken;
      OSTEON_CHECK(cut->author == author_);
      if (!decide) continue;
      ++entries_;
      (void)link.enqueue(entries_, {.room_seq = {entries_}, .kind = wire::SessionEntryKind::committed, .cut = *cut});
    }
    return taken;
  }
  Sent send(Time now) {
    Sent sent;
    DatagramBuffer buffer;
    while (const auto out = link.send(now, buffer))
      sent.emplace_back(out->to, Bytes(out->bytes.begin(), out->bytes.end()));
    return sent;
  }

 private:
  const AuthorId author_;
  std::uint64_t entries_ = 0;

 public:
  wire::ServerLink link;
};

// What a server does with each datagram before a room sees it. Every session exists twice. A twin receives the clients'
// datagrams, and no forgery.
class Server {
 public:
  explicit Server(const std::vector<SessionKeys>& sessions) {
    for (const SessionKeys& keys : sessions) sessions_.emplace(keys.session, std::make_unique<Session>(keys));
  }

  void take_genuine(const Endpoint& from, const Bytes& bytes, Time now, ForgeryReport& report) {
    Session& session = *sessions_.at(session_of(bytes).value());
    const std::uint64_t before = session.end.link.half().open_counts().opened;
    for (ServerEnd* one : {&session.end, &session.twin}) {
      one->link.receive(from, bytes, now);
      (void)one->take(true);
    }
    report.genuine_accepted += session.end.link.half().open_counts().opened - before;
  }

  void take_forged(const Endpoint& from, const Bytes& bytes, Time now, ForgeryReport& report) {
    const auto number = session_of(bytes);
    const auto found = number ? sessions_.find(*number) : sessions_.end();
    if (found == sessions_.end()) {
      ++report.unknown_session;
      return;
    }
    wire::ServerLink &link = found->second->end.link, &twin = found->second->twin.link;
    const OpenCounts before = link.half().open_counts();
    link.receive(from, bytes, now);
    const OpenCounts& after = link.half().open_counts();
    report.malformed += after.malformed - before.malformed;
    report.replayed += after.replayed - before.replayed;
    report.forged += after.forged - before.forged;
    const bool same = after.opened == before.opened && link.address() == twin.address() &&
                      link.moves() == twin.moves() && link.alive(now) == twin.alive(now) &&
                      link.next(now) == twin.next(now) && link.acknowledged() == twin.acknowledged() &&
                      link.loss() == twin.loss();
    report.accepted += same && found->second->end.take(false) == 0 ? 0 : 1;
  }

  // Sends what is due in all sessions. The twins' datagrams reach nobody. Called after every datagram, because an
  // answer may come at once or later.
  void send(Time now, ForgeryReport& report) {
    for (auto& [number, session] : sessions_) send(*session, now, report);
  }
  // What was sent since the last call.
  Sent sent() { return std::exchange(sent_, {}); }

  [[nodiscard]] std::uint64_t moves() const {
    std::uint64_t moves = 0;
    for (const auto& [number, session] : sessions_) moves += session->end.link.moves();
    return moves;
  }

 private:
  struct Session {
    explicit Session(const SessionKeys& keys) : end(keys, {keys.session}), twin(keys, {keys.session}) {}
    ServerEnd end, twin;
  };

  void send(Session& session, Time now, ForgeryReport& report) {
    Sent sent = session.end.send(now);
    const Sent expected = session.twin.send(now);
    if (sent != expected)
      for (const auto& [to, bytes] : sent) report.answered_bytes += bytes.size();
    std::ranges::move(sent, std::back_inserter(sent_));
  }

  std::map<std::uint32_t, std::unique_ptr<Session>> sessions_;
  Sent sent_;
};

// A client that cuts all the time, or one that mostly rests. The server sends little to a resting client, so an answer
// to a forgery would stand out.
struct Peer {
  Peer(const SessionKeys& keys, const Endpoint& first, Time apart)
      : link(keys, 1, 1, rekeyed({})), address(first), between_cuts(apart) {
    state.author = cut.author = {keys.session};
    cut.lease_epoch = 1;
    cut.tool.bytes.fill(7);
    cut.level = 1;
    cut.path_us = 8000;
    cut.spindle_rpm = 1000;
    cut.path.resize(2);
  }
  wire::ClientLink link;
  Endpoint address;
  Cut cut;  // the newest
  CuttingState state;
  Time between_cuts, next_cut{};
  Bytes last;  // the last datagram that the server received
  std::uint64_t sent = 0;

  // The datagram that is due. Empty if none is.
  Bytes next(std::mt19937_64& random, Time now) {
    if (now >= next_cut) {
      next_cut = now + between_cuts;
      cut.path[0] = cut.path[1];
      for (auto& p : cut.path[1].position) p += static_cast<std::int32_t>(random() % 101) - 50;
      ++cut.author_seq;
      OSTEON_CHECK(link.push(cut));
      ++state.state_seq;
      state.pose_bone_device.position_mm.x() = static_cast<double>(random() % 1000) / 100.0;
      link.set_state(state, 0);
    }
    DatagramBuffer into;
    const auto sealed = link.send(now, into);
    sent += sealed.empty() ? 0 : 1;
    return {sealed.begin(), sealed.end()};
  }
  void take(std::span<const std::uint8_t> bytes, Time now, ForgeryReport& report) {
    const std::uint64_t before = link.half().open_counts().opened;
    link.receive(bytes, now);
    report.genuine_answered += link.half().open_counts().opened - before;
    while (const auto entry = link.take_entry()) ++report.cuts_returned;
  }
};

// A forgery. It never equals a client's datagram that is still on its way.
Bytes forged(Forgery kind, const Bytes& on_its_way, const Bytes& replayed, const Bytes& of_another,
             const Bytes& reflected, std::mt19937_64& random) {
  Bytes bytes = on_its_way;
  const auto noise = [&](std::size_t from) {
    for (std::size_t i = from; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(random());
  };
  switch (kind) {
    case Forgery::noise:
      bytes.resize(random() % (kMostDatagramBytes + 100));
      noise(0);
      break;
    case Forgery::plausible_header:
      bytes.resize(kSealBytes + random() % (kMostPlainBytes + 1));
      noise(13);
      break;
    case Forgery::flipped:
      for (std::uint64_t flips = 1 + 2 * (random() % 2); flips > 0;
           --flips)  // an odd number of flips never cancels out
        bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1 << random() % 8);
      break;
    case Forgery::cut_short:
      bytes.resize(random() % bytes.size());
      break;
    case Forgery::extended: {
      const std::size_t size = bytes.size();
      bytes.resize(size + 1 + random() % 900);
      if (random() % 2 == 0) noise(size);
      break;
    }
    case Forgery::other_generation:
      bytes[4] = static_cast<std::uint8_t>(bytes[4] + 1 + random() % 255);
      break;
    case Forgery::spliced: {
      // The header of one client's datagram on the body of another's.
      bytes = of_another;
      std::copy_n(on_its_way.begin(), 13, bytes.begin());
      break;
    }
    case Forgery::replayed:
      return replayed;
    case Forgery::reflected:
      return reflected;
  }
  return bytes;
}

}  // namespace

ForgeryReport forge(std::uint64_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<SessionKeys> keys;
  for (std::uint32_t i = 0; i < kPeers; ++i) keys.push_back(make_session_keys(100 + i, seeded_bytes(seed + 1 + i)));
  Server server(keys);
  std::vector<std::unique_ptr<Peer>> peers;
  for (const SessionKeys& of : keys)
    peers.push_back(std::make_unique<Peer>(of, Endpoint{0, of.session, 1}, peers.size() < kPeers / 2 ? kCut : kRest));

  ForgeryReport report;
  Time now{};
  std::vector<Bytes> replays;  // a sample of the datagrams that the server has opened, old and new
  Bytes reflected;
  const auto answers = [&] {
    server.send(now, report);
    for (const auto& [to, answer] : server.sent()) {
      reflected = answer;
      for (const auto& peer : peers)
        if (peer->address == to) peer->take(answer, now, report);
    }
  };
  const auto deliver = [&](Peer& peer, const Bytes& bytes) {
    ++report.genuine;
    server.take_genuine(peer.address, bytes, now, report);
    peer.last = bytes;
    if (replays.size() < 1000) {
      replays.push_back(bytes);
    } else {
      replays[random() % replays.size()] = bytes;
    }
    answers();
  };
  // Before the attack, every client has sent a datagram and received an answer.
  for (bool all_answered = false; !all_answered; now += 1ms) {
    answers();
    all_answered = !reflected.empty();
    for (const auto& peer : peers) {
      if (const Bytes bytes = peer->next(random, now); !bytes.empty()) deliver(*peer, bytes);
      all_answered = all_answered && !peer->last.empty();
    }
  }

  std::uint64_t left = count;
  const auto attack = [&](Peer& peer) {
    const Bytes on_its_way = peer.next(random, now);
    if (on_its_way.empty()) return;
    for (std::uint64_t i = 0; i < kForgedForEachGenuine && left > 0; ++i, --left) {
      now += kBetween;
      const auto kind = static_cast<Forgery>(random() % kForgeries);
      const Bytes &replayed = replays[random() % replays.size()], &of_another = peers[random() % kPeers]->last;
      const Bytes bytes = forged(kind, on_its_way, replayed, of_another, reflected, random);
      // From the client's own address, from another's, or from anywhere.
      Endpoint from = peer.address;
      if (random() % 2 == 0)
        from = random() % 2 == 0 ? peers[random() % kPeers]->address : Endpoint{random(), random(), 7};
      server.take_forged(from, bytes, now, report);
      server.send(now, report);
      ++report.sent[static_cast<std::size_t>(kind)];
    }
    now += kBetween;
    deliver(peer, on_its_way);
  };
  while (left > 0) {
    now += kBetween;
    answers();
    for (const auto& peer : peers) {
      if (peer->sent % kMoveEvery == kMoveEvery - 1) {
        ++report.moves;
        ++peer->sent;
        peer->address.port = static_cast<std::uint16_t>(1 + random() % 65535);
      }
      attack(*peer);
    }
  }
  for (const auto& peer : peers) report.cuts += peer->cut.author_seq;
  report.moves_noticed = server.moves();
  report.generations = peers[0]->last[4] + 1u;
  return report;
}

}  // namespace osteon::test
