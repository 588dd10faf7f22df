#include "tests/unit/link/forgery.hpp"

#include <algorithm>
#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "common/core/check.hpp"
#include "common/link/path_watch.hpp"
#include "common/link/sealed.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using Time = std::chrono::nanoseconds;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kPeers = 4, kMoveEvery = 500;
constexpr std::uint64_t kForgedForEachGenuine = 31;
constexpr Time kBetween = 50us;
constexpr std::uint8_t kData = 0, kEcho = 1, kChallenge = 2;  // first plain byte; a token follows echo and challenge

// Keeps what is sent, for the peers and the forger to find.
class Outlet final : public DatagramPort {
 public:
  void send(const Endpoint& to, std::span<const std::uint8_t> bytes) override {
    bytes_sent += bytes.size();
    waiting.emplace_back(to, Bytes(bytes.begin(), bytes.end()));
  }
  std::optional<Datagram> receive(std::span<std::uint8_t>) override { return {}; }
  Endpoint local() const override { return {0, 1, 1}; }

  std::uint64_t bytes_sent = 0;
  std::deque<std::pair<Endpoint, Bytes>> waiting;
};

// What a server does with each datagram before anything of it reaches a room.
class Responder {
 public:
  Responder(const std::vector<SessionKeys>& sessions, const FillRandom& random, DatagramPort& port) : port_(port) {
    for (const SessionKeys& keys : sessions) sessions_.emplace(keys.session, std::make_unique<Session>(keys, random));
  }

  // Whether it was opened.
  bool take(const Endpoint& from, std::span<const std::uint8_t> bytes, Time now) {
    const auto number = session_of(bytes);
    const auto found = number ? sessions_.find(*number) : sessions_.end();
    if (found == sessions_.end()) return false;
    Session& session = *found->second;
    const auto opened = session.opener.open(bytes, now, plain_);
    if (opened) {
      session.path.heard(from, opened->newest, bytes.size(), now);
      PathToken token;
      if (opened->plain.size() > token.size() && opened->plain[0] == kEcho) {
        std::ranges::copy(opened->plain.subspan(1, token.size()), token.begin());
        if (session.path.echoed(from, token, now)) ++moves;
      }
      if (session.path.address().is_set()) {
        const std::array<std::uint8_t, 2> acknowledgement{kData, 1};
        port_.send(session.path.address(), session.sealer.seal(acknowledgement, now, sealed_));
      }
    }
    // Called after every datagram: what is due must not come sooner by a forged one.
    if (const auto challenge = session.path.challenge_due(kSealBytes + 1 + sizeof(PathToken), now)) {
      std::array<std::uint8_t, 1 + sizeof(PathToken)> plain{kChallenge};
      std::ranges::copy(challenge->token, plain.begin() + 1);
      port_.send(challenge->to, session.sealer.seal(plain, now, sealed_));
    }
    return opened.has_value();
  }

  std::uint64_t moves = 0;

 private:
  struct Session {
    Session(const SessionKeys& keys, const FillRandom& random)
        : opener(keys.session, keys.up), sealer(keys.session, keys.down), path(random) {}
    Opener opener;
    Sealer sealer;
    PathWatch path;
  };
  DatagramPort& port_;
  std::map<std::uint32_t, std::unique_ptr<Session>> sessions_;
  DatagramBuffer plain_{}, sealed_{};
};

struct Peer {
  Peer(const SessionKeys& keys, const Endpoint& first)
      : sealer(keys.session, keys.up), opener(keys.session, keys.down), address(first) {}
  Sealer sealer;
  Opener opener;
  Endpoint address;
  std::optional<PathToken> token;  // to be echoed
  Bytes last;                      // that it sent, and the server has
  std::uint64_t sent = 0, acknowledged = 0;

  Bytes next(std::mt19937_64& random, Time now) {
    Bytes plain(1 + random() % 300);
    for (auto& byte : plain) byte = static_cast<std::uint8_t>(random());
    plain[0] = kData;
    if (token) {
      plain.assign(1 + token->size(), kEcho);
      std::ranges::copy(*token, plain.begin() + 1);
      token.reset();
    }
    ++sent;
    DatagramBuffer into;
    const auto sealed = sealer.seal(plain, now, into);
    return {sealed.begin(), sealed.end()};
  }
  void take(std::span<const std::uint8_t> bytes, Time now) {
    DatagramBuffer plain;
    const auto opened = opener.open(bytes, now, plain);
    OSTEON_CHECK(opened.has_value());
    if (opened->plain[0] != kChallenge) {
      ++acknowledged;
      return;
    }
    token.emplace();
    std::ranges::copy(opened->plain.subspan(1, token->size()), token->begin());
  }
};

// Never equal to a datagram of a peer that is still on its way.
Bytes forged(Forgery kind, const Bytes& on_its_way, const Bytes& replayed, const Bytes& of_another, const Bytes& reflected,
             std::mt19937_64& random) {
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
      for (std::uint64_t flips = 1 + 2 * (random() % 2); flips > 0; --flips)  // an odd number never undoes itself
        bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1 << random() % 8);
      break;
    case Forgery::cut_short: bytes.resize(random() % bytes.size()); break;
    case Forgery::extended: {
      const std::size_t size = bytes.size();
      bytes.resize(size + 1 + random() % 900);
      if (random() % 2 == 0) noise(size);
      break;
    }
    case Forgery::other_generation: bytes[4] = static_cast<std::uint8_t>(bytes[4] + 1 + random() % 255); break;
    case Forgery::spliced: {
      // The header of one peer's datagram on the body of another's.
      bytes = of_another;
      std::copy_n(on_its_way.begin(), 13, bytes.begin());
      break;
    }
    case Forgery::replayed: return replayed;
    case Forgery::reflected: return reflected;
  }
  return bytes;
}

}  // namespace

ForgeryReport forge(std::uint64_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const FillRandom fill = [&random](std::span<std::uint8_t> into) {
    for (auto& byte : into) byte = static_cast<std::uint8_t>(random());
  };
  std::vector<SessionKeys> keys;
  for (std::uint32_t i = 0; i < kPeers; ++i) keys.push_back(make_session_keys(100 + i, fill));
  Outlet outlet;
  Responder server(keys, fill, outlet);
  std::vector<std::unique_ptr<Peer>> peers;
  for (const SessionKeys& of : keys) peers.push_back(std::make_unique<Peer>(of, Endpoint{0, of.session, 1}));

  ForgeryReport report;
  Time now{};
  std::vector<Bytes> replays;  // a sample of what the server has opened, of all ages
  Bytes reflected = peers[0]->next(random, now);
  const auto deliver = [&](Peer& peer, const Bytes& bytes) {
    ++report.genuine;
    report.genuine_accepted += server.take(peer.address, bytes, now) ? 1 : 0;
    peer.last = bytes;
    if (replays.size() < 1000) {
      replays.push_back(bytes);
    } else {
      replays[random() % replays.size()] = bytes;
    }
    for (; !outlet.waiting.empty(); outlet.waiting.pop_front()) {
      const auto& [to, answer] = outlet.waiting.front();
      reflected = answer;
      for (const auto& other : peers)
        if (other->address == to) other->take(answer, now);
    }
  };
  deliver(*peers[0], reflected);
  for (const auto& peer : peers) deliver(*peer, peer->next(random, now));

  for (std::uint64_t left = count; left > 0;) {
    // One peer sends most, and so changes keys; all of them move now and then.
    Peer& peer = *peers[random() % 4 == 0 ? random() % kPeers : 0];
    if (peer.sent % kMoveEvery == kMoveEvery - 1) {
      ++report.moves;
      peer.address.port = static_cast<std::uint16_t>(1 + random() % 65535);
    }
    const Bytes on_its_way = peer.next(random, now);
    for (std::uint64_t i = 0; i < kForgedForEachGenuine && left > 0; ++i, --left) {
      now += kBetween;
      const auto kind = static_cast<Forgery>(random() % kForgeries);
      const Bytes &replayed = replays[random() % replays.size()], &of_another = peers[random() % kPeers]->last;
      const Bytes bytes = forged(kind, on_its_way, replayed, of_another, reflected, random);
      // From the peer's own address, from another's, or from anywhere.
      Endpoint from = peer.address;
      if (random() % 2 == 0) from = random() % 2 == 0 ? peers[random() % kPeers]->address : Endpoint{random(), random(), 7};
      const std::uint64_t before = outlet.bytes_sent;
      report.accepted += server.take(from, bytes, now) ? 1 : 0;
      report.answered_bytes += outlet.bytes_sent - before;
      ++report.sent[static_cast<std::size_t>(kind)];
    }
    now += kBetween;
    deliver(peer, on_its_way);
  }
  for (const auto& peer : peers) report.genuine_answered += peer->acknowledged;
  report.moves_noticed = server.moves;
  report.generations = peers[0]->sealer.generation() + 1;
  return report;
}

}  // namespace osteon::test
