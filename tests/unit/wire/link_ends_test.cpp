// The two ends of the fast path on networks from good to hostile, on virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "tests/scenario/recording.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/trials.hpp"
#include "tests/unit/wire/link_pair.hpp"
#include "tests/unit/wire/link_trial.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::hostile;
using test::LinkPair;
using test::node;
using test::PathQuality;
using test::Random;
using test::Time;
using test::Trial;
using test::TrialOptions;
using test::trials;

double ms(Time t) { return std::chrono::duration<double, std::milli>(t).count(); }

double share_of(std::vector<double>& values, double share) {
  std::ranges::sort(values);
  return values.empty() ? 0.0 : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

TEST(LinkEnds, EverythingOnceAndInOrderOnAHostileNetwork) {
  std::size_t cuts = 0, by_stream = 0, entries = 0;
  std::vector<double> settled_ms;
  std::uint64_t corrupted = 0, forged = 0;
  std::size_t most_waiting = 0, words = 0, long_words = 0;
  const unsigned seeds = trials(200);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    Trial trial({.seed = seed, .quality = hostile()});
    Random random(seed);
    if (seed % 4 != 0) {
      const Time from(static_cast<std::int64_t>(random.between(0.2e9, 2.2e9)));
      const Time until = from + Time(static_cast<std::int64_t>(random.between(0.3e9, seed % 4 == 1 ? 3e9 : 0.8e9)));
      if (seed % 4 == 3)
        trial.partition(from, until);
      else
        trial.block(from, until);
    }
    trial.time.run_until(400ms);
    trial.cut(true);
    trial.time.run_until(2400ms);
    trial.cut(false);
    const Time took = trial.settle(8s);
    ASSERT_TRUE(trial.exact()) << "seed " << seed;
    ASSERT_TRUE(trial.settled()) << "seed " << seed;
    if (seed % 4 == 0) settled_ms.push_back(ms(took));
    for (std::size_t c = 0; c < Trial::kClients; ++c) {
      cuts += trial.clients[c]->cuts.size();
      entries += trial.clients[c]->entries.size();
      by_stream += trial.clients[c]->entries_by_stream;
      for (const wire::IndexedEntry& entry : trial.clients[c]->entries) {
        words += entry.entry.kind == wire::SessionEntryKind::supervised;
        long_words += entry.entry.kind == wire::SessionEntryKind::supervised && !wire::fits_a_packet(entry.entry);
      }
      forged +=
          trial.sessions[c]->link.half().open_counts().forged + trial.clients[c]->link.half().open_counts().forged;
      most_waiting = std::max(most_waiting, trial.clients[c]->most_waiting);
      EXPECT_EQ(trial.sessions[c]->link.half().counts().malformed, 0u);
      EXPECT_EQ(trial.clients[c]->link.half().counts().malformed, 0u);
    }
    corrupted += trial.network.counts().paths.corrupted;
  }
  std::printf(
      "%u seeds: %zu cuts, %zu entries taken, %zu of them by stream; %llu datagrams corrupted, %llu seen as forged; "
      "without partition settled after p50 %.0f, most %.0f ms\n",
      seeds, cuts, entries, by_stream, static_cast<unsigned long long>(corrupted),
      static_cast<unsigned long long>(forged), share_of(settled_ms, 0.5), share_of(settled_ms, 1.0));
  EXPECT_GT(words, trials(100));
  EXPECT_GT(long_words, trials(20));
  EXPECT_GT(words - long_words, long_words / 2);
  // Duplicates of corrupted datagrams count twice. Flips in the session or the counter count as another fault.
  EXPECT_GT(forged, corrupted / 3);
  EXPECT_LE(most_waiting, 16u * 1024);
  EXPECT_LT(share_of(settled_ms, 1.0), 2000.0);
}

TEST(LinkEnds, DelayUntilAPartnerHasACut) {
  for (const bool bad : {false, true}) {
    std::vector<double> felt;
    double up = 0, down = 0;
    PathQuality quality = hostile(40ms);
    quality.reorder = quality.duplicate = quality.corrupt = 0;
    const unsigned seeds = trials(40);
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      Trial trial({.seed = seed, .quality = bad ? quality : PathQuality{}, .long_cuts = 0, .events = 0});
      trial.time.run_until(1s);
      trial.cut(true);
      trial.time.run_until(5s);
      trial.cut(false);
      trial.settle(4s);
      ASSERT_TRUE(trial.settled());
      up += static_cast<double>(trial.clients[0]->uplink_bytes) * 8 / 5000 / seeds;
      down += static_cast<double>(trial.sessions[0]->downlink_bytes) * 8 / 5000 / seeds;
      for (const auto& client : trial.clients) felt.insert(felt.end(), client->felt_ms.begin(), client->felt_ms.end());
    }
    std::printf("%s: p50 %.1f p90 %.1f p99 %.1f p99.9 %.1f max %.1f ms; %.0f kbit/s up, %.0f down\n",
                bad ? "40 +- 10 ms, 30 % lost" : "no impairment", share_of(felt, 0.5), share_of(felt, 0.9),
                share_of(felt, 0.99), share_of(felt, 0.999), share_of(felt, 1), up, down);
    EXPECT_LE(share_of(felt, 0.99), bad ? 135.0 : 25.0);
  }
}

// Drilling and burring as recorded at 125 cuts a second for 8 s, then a hand that holds the tool still for 8 s.
TEST(LinkEnds, UplinkBytesOfDrillingAndRest) {
  const auto recording =
      test::read_recording(test::source_dir() / "tests" / "scenario" / "recordings" / "drill_and_burr");
  ASSERT_TRUE(recording) << recording.error().message;
  for (const double loss : {0.0, 0.3}) {
    PathQuality quality;
    quality.delay = 40ms;
    quality.loss = loss;
    Trial trial({.quality = quality, .long_cuts = 0, .events = 0, .cut = [&](std::size_t, std::uint64_t number) {
                   Cut cut = recording->cuts.at((number - 1) % recording->cuts.size());
                   cut.path_us = 8000;
                   return cut;
                 }});
    std::array<std::uint64_t, 2> before{}, cutting{}, idle{};
    trial.time.run_until(1s);
    const auto read = [&](std::array<std::uint64_t, 2>& into) {
      into = {trial.clients[0]->uplink_bytes, trial.sessions[0]->downlink_bytes};
    };
    read(before);
    trial.cut(true);
    trial.time.run_until(9s);
    read(cutting);
    trial.cut(false);
    trial.time.run_until(10s);
    EXPECT_TRUE(trial.settled() && trial.exact());
    EXPECT_EQ(trial.clients[0]->cuts.size(), 1000u);
    EXPECT_EQ(trial.clients[0]->refused, 0u);
    std::array<std::uint64_t, 2> rest{};
    read(rest);
    trial.time.run_until(18s);
    read(idle);
    const auto kbit = [](std::uint64_t bytes) { return static_cast<double>(bytes) * 8.0 / 8000.0; };
    const double up = kbit(cutting[0] - before[0]), up_idle = kbit(idle[0] - rest[0]);
    std::printf(
        "loss %2.0f %%: up %.0f kbit/s while cutting, %.1f idle (%.1f %% less); down %.0f with two tools, %.1f idle\n",
        100 * loss, up, up_idle, 100 * (1 - up_idle / up), kbit(cutting[1] - before[1]), kbit(idle[1] - rest[1]));
    EXPECT_LE(up, 300.0);
    EXPECT_LE(up_idle, 0.2 * up);
    EXPECT_TRUE(trial.clients[0]->link.alive(trial.time.now()) && trial.sessions[0]->link.alive(trial.time.now()));
  }
}

TEST(LinkEnds, NewKeysWhilePacketsAreInFlight) {
  std::size_t entries = 0, by_stream = 0;
  for (std::uint64_t seed = 1; seed <= trials(20); ++seed) {
    TrialOptions options{.seed = seed, .quality = hostile()};
    options.up.seal.rekey_packets = options.down.seal.rekey_packets = 40;
    options.up.seal.previous_for = options.down.seal.previous_for = 1s;
    Trial trial(options);
    trial.time.run_until(400ms);
    trial.cut(true);
    trial.time.run_until(2400ms);
    trial.cut(false);
    trial.settle(5s);
    ASSERT_TRUE(trial.exact() && trial.settled()) << "seed " << seed;
    for (std::size_t c = 0; c < Trial::kClients; ++c) {
      EXPECT_GT(trial.clients[c]->link.half().counts().packets_sent / 40, 3u) << "keys";
      entries += trial.clients[c]->entries.size();
      by_stream += trial.clients[c]->entries_by_stream;
    }
  }
  // All entries took the fast path, but for those of the first moments and of cuts too long for a packet.
  std::printf("%zu entries, %zu by stream\n", entries, by_stream);
  EXPECT_LT(by_stream, entries / 5);
}

TEST(LinkEnds, AClientThatMovesIsFoundWithinASecond) {
  std::vector<double> found_ms;
  for (const bool cutting : {true, false}) {
    for (std::uint64_t seed = 1; seed <= trials(150); ++seed) {
      Trial trial({.seed = seed, .quality = hostile()});
      trial.time.run_until(500ms);
      trial.cut(cutting);
      trial.time.run_until(2s);
      trial.move_client(0, node(2, 77));
      const Time moved = trial.time.now();
      while (trial.sessions[0]->link.address() != node(2, 77) && trial.time.now() < moved + 5s)
        trial.time.run_until(trial.time.now() + 1ms);
      found_ms.push_back(ms(trial.time.now() - moved));
      EXPECT_EQ(trial.sessions[0]->link.moves(), 2u);
      if (seed > trials(40)) continue;
      trial.cut(false);
      trial.settle(5s);
      EXPECT_TRUE(trial.exact() && trial.settled()) << "seed " << seed;
      trial.time.run_until(std::max(trial.time.now(), moved + 2s));
      EXPECT_TRUE(trial.clients[0]->link.alive(trial.time.now()));
    }
  }
  std::printf("a move at 100 +- 10 ms and 30 %% lost: p50 %.0f p99 %.0f most %.0f ms\n", share_of(found_ms, 0.5),
              share_of(found_ms, 0.99), share_of(found_ms, 1));
  EXPECT_LT(share_of(found_ms, 0.99), 1000.0);
}

// An attacker on the path sends copies from another address. Some follow the original. Some arrive before it.
TEST(LinkEnds, AThirdPartyMovesNothing) {
  Trial trial({.quality = {.delay = 20ms}});
  const auto third = trial.network.open(node(9));
  std::size_t copied_bytes = 0, answered_bytes = 0;
  third->on_arrival([&] {
    DatagramBuffer buffer;
    while (const auto got = third->receive(buffer)) {
      answered_bytes += got->bytes.size();
      // The attacker passes it on to the client. The client answers the server from its own address.
      third->send(trial.clients[0]->port->local(), got->bytes);
    }
  });
  bool ahead = false;
  std::size_t seen = 0;
  trial.tap = [&](std::size_t c, std::span<const std::uint8_t> bytes) {
    if (c != 0) return false;
    ++seen;
    if (!ahead) {
      // After the original, several times.
      trial.time.post_in(1ms, [&, copy = std::vector(bytes.begin(), bytes.end())] {
        for (int i = 0; i < 3; ++i) third->send(trial.server_port->local(), copy);
      });
      return false;
    }
    if (seen % 25 != 0) return false;
    copied_bytes += bytes.size();
    third->send(trial.server_port->local(), bytes);
    return true;  // and the original never arrives
  };
  trial.time.run_until(500ms);
  trial.cut(true);
  trial.time.run_until(3s);
  EXPECT_EQ(answered_bytes, 0u) << "replayed datagrams are not answered";
  EXPECT_GT(trial.sessions[0]->link.half().open_counts().replayed, 500u);
  ahead = true;
  trial.time.run_until(8s);
  EXPECT_GT(copied_bytes, 1000u);
  EXPECT_GT(answered_bytes, 0u) << "challenged";
  EXPECT_LE(answered_bytes, 3 * copied_bytes);
  EXPECT_EQ(trial.sessions[0]->link.address(), node(2));
  EXPECT_EQ(trial.sessions[0]->link.moves(), 1u);
  trial.cut(false);
  trial.settle(3s);
  EXPECT_TRUE(trial.exact() && trial.settled());
}

TEST(LinkEnds, WithoutDatagramsAllGoesOverTheStream) {
  for (const Time dies : {0s, 2s}) {
    Trial trial({.quality = hostile()});
    trial.block(dies, 1h);
    trial.cut(true);
    trial.time.run_until(20s);
    trial.cut(false);
    const Time took = trial.settle(3s);
    EXPECT_TRUE(trial.exact() && trial.settled());
    EXPECT_LE(took, 500ms);
    EXPECT_FALSE(trial.clients[0]->link.alive(trial.time.now()) || trial.sessions[0]->link.alive(trial.time.now()));
    for (std::size_t c = 0; c < Trial::kClients; ++c) {
      EXPECT_EQ(trial.clients[c]->entries.size(), trial.sessions[c]->entries.size());
      EXPECT_GT(trial.clients[c]->entries.size(), 4000u);
      EXPECT_LE(trial.clients[c]->most_waiting, 16u * 1024);
      // The probes for a living peer take little.
      EXPECT_LT(static_cast<double>(trial.clients[c]->uplink_bytes) * 8 / 20e3, 100.0);
      if (dies == 0s) {
        EXPECT_EQ(trial.sessions[c]->downlink_bytes, 0u);
      }
    }
  }
}

TEST(LinkEnds, BackAndForthBetweenDatagramsAndStream) {
  for (std::uint64_t seed = 1; seed <= trials(20); ++seed) {
    Trial trial({.seed = seed, .quality = hostile()});
    for (int i = 0; i < 5; ++i) trial.block(1s + i * 3s, 2500ms + i * 3s);
    trial.time.run_until(400ms);
    trial.cut(true);
    trial.time.run_until(16s);
    std::array<std::uint64_t, 2> by_stream{}, entries{};
    for (std::size_t c = 0; c < 2; ++c) {
      EXPECT_TRUE(trial.clients[c]->link.alive(trial.time.now()) && trial.sessions[c]->link.alive(trial.time.now()));
      by_stream[c] = trial.clients[c]->entries_by_stream;
      entries[c] = trial.clients[c]->entries.size();
    }
    // After the last change the fast path is used again, but for what is too long for it.
    trial.time.run_until(20s);
    for (std::size_t c = 0; c < 2; ++c)
      EXPECT_LT(trial.clients[c]->entries_by_stream - by_stream[c], (trial.clients[c]->entries.size() - entries[c]) / 8)
          << "seed " << seed;
    trial.cut(false);
    trial.settle(5s);
    ASSERT_TRUE(trial.exact() && trial.settled()) << "seed " << seed;
  }
}

// Only the challenged address can answer a challenge.
TEST(LinkEnds, AnEchoFromElsewhereProvesNothing) {
  LinkPair pair;
  pair.run(300ms);
  ASSERT_EQ(pair.server.address(), node(2));
  const auto sealed = [&](const v1::UpPacket& packet) {
    DatagramBuffer buffer;
    const std::string plain = packet.SerializeAsString();
    const auto bytes =
        pair.forger_up.seal({reinterpret_cast<const std::uint8_t*>(plain.data()), plain.size()}, pair.now, buffer);
    return std::vector(bytes.begin(), bytes.end());
  };
  const auto token_sent_to = [&](const Endpoint& to) {
    DatagramBuffer buffer, plain;
    v1::DownPacket packet;
    while (const auto out = pair.server.send(pair.now, buffer)) {
      const auto opened = pair.reads_down.open(out->bytes, pair.now, plain);
      if (out->to == to) packet.ParseFromArray(opened->plain.data(), static_cast<int>(opened->plain.size()));
    }
    return packet.path_challenge();
  };
  v1::UpPacket empty, echo;
  empty.mutable_times()->set_sent_us(1);
  pair.server.receive(node(9), sealed(empty), pair.now);
  echo.set_path_echo(token_sent_to(node(9)));
  ASSERT_EQ(echo.path_echo().size(), sizeof(PathToken));
  // A later packet arrives from the new address first, so the packet with the echo is not the newest.
  const auto from_old = sealed(echo), from_new = sealed(empty);
  pair.server.receive(node(9), from_new, pair.now);
  pair.server.receive(node(2), from_old, pair.now);
  EXPECT_EQ(pair.server.moves(), 1u);
  EXPECT_EQ(pair.server.address(), node(2));
  pair.server.receive(node(9), sealed(echo), pair.now);
  EXPECT_EQ(pair.server.moves(), 2u);
  EXPECT_EQ(pair.server.address(), node(9));
}

TEST(LinkEnds, AliveIsWhoGetsThroughBothWays) {
  // A challenge shows the client that the server receives its packets. It does not show that the server knows its
  // address.
  LinkPair challenged;
  challenged.lost = [](const v1::UpPacket& packet) { return !packet.path_echo().empty(); };
  challenged.run(300ms);
  ASSERT_FALSE(challenged.downs.empty());
  EXPECT_FALSE(challenged.client.alive(challenged.now) || challenged.server.alive(challenged.now));
  challenged.lost = {};
  challenged.run(300ms);
  EXPECT_TRUE(challenged.client.alive(challenged.now) && challenged.server.alive(challenged.now));

  // First the server's packets are lost, then those of both. A client at a new address is not yet reached there.
  LinkPair pair;
  pair.run(300ms);
  pair.lost_down = [](const v1::DownPacket&) { return true; };
  pair.run(700ms);
  EXPECT_FALSE(pair.client.alive(pair.now));
  EXPECT_TRUE(pair.server.alive(pair.now));
  pair.lost = [](const v1::UpPacket&) { return true; };
  pair.run(600ms);
  EXPECT_FALSE(pair.server.alive(pair.now));
  DatagramBuffer buffer;
  pair.server.receive(node(9), pair.forger_up.seal({}, pair.now, buffer), pair.now);
  EXPECT_FALSE(pair.server.alive(pair.now));
}

// A client receives its server's packets, but its own are lost. It must not put its cuts into datagrams for ever.
TEST(LinkEnds, AClientWhosePacketsAreLostIsNotAlive) {
  LinkPair pair;
  pair.run(300ms);
  ASSERT_TRUE(pair.client.alive(pair.now));
  pair.lost = [](const v1::UpPacket&) { return true; };
  const std::size_t received = pair.downs.size();
  pair.run(1500ms);
  EXPECT_GT(pair.downs.size(), received);
  EXPECT_FALSE(pair.client.alive(pair.now));
  pair.lost = {};
  pair.run(700ms);
  EXPECT_TRUE(pair.client.alive(pair.now));
}

// An earlier session of the author brought some cuts, and the room decides them only now. Both ends meet them.
TEST(LinkEnds, CutsOfAnEarlierSessionAreLeftOut) {
  LinkPair pair;
  pair.run(300ms);
  pair.server.decided(2);
  pair.server.decided(1);
  EXPECT_FALSE(pair.server.insert(pair.cut(2)));
  ASSERT_TRUE(pair.client.push(pair.cut(3)));
  ASSERT_TRUE(pair.client.push(pair.cut(4)));
  pair.run(100ms);
  EXPECT_EQ(pair.client.acknowledged(), 2u);
  EXPECT_EQ(pair.server.take_cut(), pair.cut(3));
  EXPECT_EQ(pair.server.take_cut(), pair.cut(4));
  pair.server.decided(4);
  pair.run(100ms);
  EXPECT_EQ(pair.client.acknowledged(), 4u);
  EXPECT_TRUE(pair.client.half().window().empty());
}

// A log entry of the client's own cut also decides that cut.
TEST(LinkEnds, AnEntryDecidesTheOwnCutInIt) {
  LinkPair pair;
  pair.run(300ms);
  for (std::uint64_t n = 1; n <= 3; ++n) ASSERT_TRUE(pair.client.push(pair.cut(n)));
  pair.run(100ms);
  const auto acknowledged = [&] {
    pair.run(100ms);
    return pair.client.acknowledged();
  };
  Cut of_another = pair.cut(2);
  of_another.author = AuthorId{pair.cut(2).author.value + 1};
  EXPECT_TRUE(pair.server.enqueue(1, {.room_seq = {1}, .kind = wire::SessionEntryKind::committed, .cut = of_another}));
  EXPECT_EQ(acknowledged(), 0u) << "another's cut";
  EXPECT_TRUE(pair.server.enqueue(2, {.room_seq = {2}, .kind = wire::SessionEntryKind::committed, .cut = pair.cut(1)}));
  EXPECT_EQ(acknowledged(), 1u);
  EXPECT_FALSE(pair.server.enqueue(0, {.room_seq = {2}, .kind = wire::SessionEntryKind::committed, .cut = pair.cut(2)}))
      << "it has no number";
  EXPECT_EQ(acknowledged(), 2u);
  wire::SessionEntry rejection{.room_seq = {3}, .kind = wire::SessionEntryKind::rejected};
  rejection.author_seq = 3;
  rejection.lease_epoch = 4;
  EXPECT_TRUE(pair.server.enqueue(3, rejection));
  EXPECT_EQ(acknowledged(), 3u);
  EXPECT_EQ(pair.client.lease_epoch(), 4u);
  std::vector<std::uint64_t> received;
  while (const auto entry = pair.client.take_entry()) received.push_back(entry->index);
  EXPECT_EQ(received, (std::vector<std::uint64_t>{1, 2, 3})) << "the entry without a number is not sent";
}

// The packet itself says that the client is frozen. The client need not wait for the log entry.
TEST(LinkEnds, AnInstructorsDecisionFreezesAndEndsTheLease) {
  LinkPair pair;
  pair.run(300ms);
  wire::SessionEntry word{.room_seq = {5},
                          .kind = wire::SessionEntryKind::supervised,
                          .lease_epoch = 6,
                          .supervision = {.taken_by = {3}},
                          .by = {AuthorId{3}, "Dr. Weber"}};
  EXPECT_TRUE(pair.server.enqueue(1, word));
  pair.run(100ms);
  EXPECT_TRUE(pair.client.frozen());
  EXPECT_EQ(pair.client.lease_epoch(), 6u);
  word.lease_epoch = 8;
  word.supervision = {};
  for (std::uint8_t n = 0; n <= wire::kMostToolsInPacket; ++n) word.supervision.tools.push_back(Digest{{n}});
  EXPECT_FALSE(pair.server.enqueue(2, word)) << "too long: the stream carries the entry, a packet the freeze and epoch";
  pair.run(100ms);
  EXPECT_FALSE(pair.client.frozen());
  EXPECT_EQ(pair.client.lease_epoch(), 8u);
  const auto first = pair.client.take_entry();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->entry.supervision, (Restrictions{.taken_by = {3}}));
  EXPECT_EQ(first->entry.by, (Decider{AuthorId{3}, "Dr. Weber"}));
  EXPECT_FALSE(pair.client.take_entry());
  EXPECT_EQ(pair.client.entries_arrived(), 1u);
  EXPECT_TRUE(pair.client.received_one(2));
  EXPECT_EQ(pair.client.entries_arrived(), 2u);
  EXPECT_FALSE(pair.client.take_entry()) << "the stream has delivered it";
}

// After a long stop the stream delivers thousands of log entries at once.
TEST(LinkEnds, EntriesGoOnAfterAnyNumberThatTheStreamDelivered) {
  constexpr std::uint64_t kEntries = 5000;
  LinkPair pair;
  pair.run(300ms);
  const auto entry = [&](std::uint64_t n) {
    return wire::IndexedEntry{n, {.room_seq = {n}, .kind = wire::SessionEntryKind::committed, .cut = pair.cut(n)}};
  };
  for (std::uint64_t n = 1; n <= kEntries; ++n) {
    (void)pair.server.push(entry(n));
    pair.client.received(n);
  }
  EXPECT_FALSE(pair.client.take_entry());
  pair.run(500ms);
  EXPECT_EQ(pair.server.acknowledged(), kEntries);
  EXPECT_TRUE(pair.server.push(entry(kEntries + 1)));
  pair.run(100ms);
  const auto taken = pair.client.take_entry();
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->index, kEntries + 1);
  EXPECT_EQ(taken->entry.cut, pair.cut(kEntries + 1));
}

// A packet that arrived ahead of its turn is known, and is not sent again.
TEST(LinkEnds, OnlyWhatIsMissingIsRepeated) {
  wire::LinkOptions up, down = wire::server_link_options();
  up.rate.fewest_repeats = up.rate.most_repeats = down.rate.fewest_repeats = down.rate.most_repeats = 1;
  LinkPair pair(up, down);
  pair.run(300ms);
  ASSERT_TRUE(pair.client.alive(pair.now) && pair.server.alive(pair.now));
  std::array<int, 21> cuts{}, entries{};
  const auto count = [](auto& counts, std::uint64_t number) { return ++counts.at(number); };
  pair.lost = [&](const v1::UpPacket& packet) {
    bool first = false;
    for (const v1::CutRun& run : packet.cuts()) {
      const auto read = wire::cuts_of(run, {7}, pair.server.tools());
      for (const Cut& cut : *read)
        if (count(cuts, cut.author_seq) == 1 && cut.author_seq == 1) first = true;
    }
    return first;
  };
  pair.lost_down = [&](const v1::DownPacket& packet) {
    bool first = false;
    const auto read = wire::entries_of(packet, pair.client.tools());
    for (const wire::IndexedEntry& entry : *read)
      if (count(entries, entry.index) == 1 && entry.index == 1) first = true;
    return first;
  };
  for (std::uint64_t n = 1; n <= 20; ++n) {
    ASSERT_TRUE(pair.client.push(pair.cut(n)));
    ASSERT_TRUE(
        pair.server.push({n, {.room_seq = {n}, .kind = wire::SessionEntryKind::committed, .cut = pair.cut(n)}}));
    pair.run(8ms);
  }
  pair.run(200ms);
  for (std::size_t n = 2; n <= 20; ++n) {
    EXPECT_EQ(cuts[n], 1) << n;
    EXPECT_EQ(entries[n], 1) << n;
  }
  EXPECT_GE(cuts[1], 2);
  EXPECT_GE(entries[1], 2);
  // Entries come out as they arrive, each once. The first was lost, and arrived after some of the others.
  std::vector<std::uint64_t> arrived;
  while (const auto entry = pair.client.take_entry()) {
    EXPECT_EQ(entry->entry.cut, pair.cut(entry->index));
    arrived.push_back(entry->index);
  }
  EXPECT_NE(arrived.front(), 1u);
  std::ranges::sort(arrived);
  for (std::uint64_t n = 1; n <= 20; ++n) {
    EXPECT_EQ(pair.server.take_cut(), pair.cut(n));
    EXPECT_EQ(arrived.at(n - 1), n);
  }
  EXPECT_EQ(arrived.size(), 20u);
  EXPECT_EQ(pair.client.entries_arrived(), 20u);
  // Received is not committed. Only decided cuts are acknowledged.
  EXPECT_EQ(pair.client.acknowledged(), 0u);
  pair.server.decided(12);
  pair.run(50ms);
  EXPECT_EQ(pair.client.acknowledged(), 12u);
  EXPECT_EQ(pair.server.acknowledged(), 20u);
}

TEST(LinkEnds, AFullWindowLeavesTheRestToTheStream) {
  LinkPair pair;
  std::uint64_t number = 0;
  while (pair.client.push(pair.cut(number + 1, 20))) ++number;
  EXPECT_GT(pair.client.half().window().bytes_unacknowledged(), 15u * 1024);
  EXPECT_LE(pair.client.half().window().bytes_unacknowledged(), 16u * 1024);
  ++number;  // refused
  const std::uint64_t refused = number;
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(pair.client.push(pair.cut(++number, 20)));
  // The stream delivers the refused cuts. The others arrive in datagrams.
  for (std::uint64_t n = refused; n <= number; ++n) EXPECT_TRUE(pair.server.insert(pair.cut(n, 20)));
  std::uint64_t taken = 0;
  for (int i = 0; i < 20; ++i) {
    pair.run(100ms);
    while (const auto cut = pair.server.take_cut()) EXPECT_EQ(*cut, pair.cut(++taken, 20));
    pair.server.decided(taken);
  }
  EXPECT_EQ(taken, number);
  pair.run(100ms);
  EXPECT_EQ(pair.client.acknowledged(), number);
  EXPECT_TRUE(pair.client.half().window().empty());
  // The link goes on from there, with a cut too long for a packet between two others.
  EXPECT_TRUE(pair.client.push(pair.cut(number + 1)));
  EXPECT_FALSE(pair.client.push(pair.cut(number + 2, 40)));
  EXPECT_TRUE(pair.client.push(pair.cut(number + 3)));
  pair.run(100ms);
  EXPECT_EQ(pair.server.take_cut(), pair.cut(number + 1));
  EXPECT_FALSE(pair.server.take_cut());
  EXPECT_TRUE(pair.server.insert(pair.cut(number + 2, 40)));
  EXPECT_FALSE(pair.server.insert(pair.cut(number + 2, 40)));
  EXPECT_EQ(pair.server.take_cut(), pair.cut(number + 2, 40));
  EXPECT_EQ(pair.server.take_cut(), pair.cut(number + 3));
  pair.server.decided(number + 3);
  pair.run(100ms);
  EXPECT_EQ(pair.client.acknowledged(), number + 3);
}

TEST(LinkEnds, WhatNoCorrectPeerSendsChangesNothing) {
  LinkPair pair;
  pair.run(300ms);
  for (std::uint64_t n = 1; n <= 3; ++n) {
    ASSERT_TRUE(pair.client.push(pair.cut(n)));
    ASSERT_TRUE(
        pair.server.push({n, {.room_seq = {n}, .kind = wire::SessionEntryKind::committed, .cut = pair.cut(n)}}));
  }
  v1::UpPacket up;
  up.set_acknowledged(4);
  up.mutable_times()->set_received_counter(1'000'000);
  up.mutable_times()->set_received_packets(1'000'000);
  up.mutable_times()->set_echo_sent_us(~std::uint64_t{0});
  const double loss = pair.server.loss();
  const auto clock = pair.server.clock(pair.now);
  pair.forge(up);
  EXPECT_EQ(pair.server.acknowledged(), 0u);
  EXPECT_EQ(pair.server.loss(), loss);
  EXPECT_EQ(pair.server.clock(pair.now)->round_trip, clock->round_trip);
  v1::DownPacket down;
  down.set_acknowledged(~std::uint64_t{0});
  pair.forge(down);
  EXPECT_EQ(pair.client.acknowledged(), 0u);

  // Cuts with any number, up to the end of the window and far beyond it. No memory grows.
  SendWindow window({1 << 20, 1 << 16, wire::kRunBytes}, 1);
  wire::ToolNumbers none;
  wire::CutSender sender(window, none);
  for (std::uint64_t n = 1; n <= 5000; ++n) ASSERT_TRUE(sender.push(pair.cut(n)));
  for (std::uint64_t n = 2; n <= 5000; ++n) {
    v1::UpPacket far;
    far.add_cuts()->ParseFromString(window.item(n).head);
    far.mutable_cuts(0)->set_cuts(window.item(n).bytes);
    far.mutable_cuts(0)->set_author_seq(n % 7 == 0 ? ~std::uint64_t{0} - n : n);
    pair.forge(far);
  }
  EXPECT_FALSE(pair.server.take_cut());
  EXPECT_EQ(pair.server.half().counts().malformed, 0u);

  // A packet that cannot be read, or that no program sends, is counted. Nothing of it is taken, not even its valid
  // part.
  const auto malformed = [&](v1::UpPacket packet) {
    const std::uint64_t before = pair.server.half().counts().malformed;
    packet.set_acknowledged(3);
    pair.forge(packet);
    EXPECT_EQ(pair.server.half().counts().malformed, before + 1);
    EXPECT_EQ(pair.server.acknowledged(), 0u);
  };
  v1::UpPacket bad;
  bad.set_path_echo("short");
  malformed(bad);
  bad.Clear();
  bad.mutable_state()->set_state_seq(1);
  malformed(bad);
  bad.Clear();
  bad.add_cuts()->set_level(9);
  malformed(bad);
  const auto malformed_down = [&](v1::DownPacket packet) {
    const std::uint64_t before = pair.client.half().counts().malformed;
    packet.set_acknowledged(3);
    packet.set_frozen(true);
    pair.forge(packet);
    EXPECT_EQ(pair.client.half().counts().malformed, before + 1);
    EXPECT_EQ(pair.client.acknowledged(), 0u);
    EXPECT_FALSE(pair.client.frozen());
  };
  v1::DownPacket bad_down;
  bad_down.set_path_challenge("short");
  malformed_down(bad_down);
  bad_down.Clear();
  bad_down.add_partners()->set_state_seq(1);
  malformed_down(bad_down);
  bad_down.Clear();
  bad_down.add_entries();
  malformed_down(bad_down);
  // An entry without its content waits for the stream's copy.
  v1::DownPacket marker;
  marker.add_streamed()->set_index(1);
  pair.forge(marker);
  EXPECT_FALSE(pair.client.take_entry());
  EXPECT_EQ(pair.client.entries_arrived(), 0u);
  EXPECT_TRUE(pair.client.received_one(1));
  EXPECT_FALSE(pair.client.received_one(1));
  EXPECT_EQ(pair.client.entries_arrived(), 1u);
  // The link keeps the latest partners, however many there are.
  CuttingState state;
  state.phase = CuttingPhase::free;
  for (std::uint64_t author = 1; author <= 1000; ++author) {
    state.author = {author};
    state.state_seq = 1;
    v1::DownPacket packet;
    *packet.add_partners() = wire::to_tool_state(state, 0, false);
    pair.forge(packet);
    pair.now += 1us;
  }
  const auto kept = pair.client.partners(pair.now);
  ASSERT_EQ(kept.size(), wire::ClientLink::kMostPartners);
  for (const auto& partner : kept) EXPECT_GT(partner.state.author.value, 1000 - wire::ClientLink::kMostPartners);
}

// A hand that trembles within the deadband costs as much as a resting hand. A moving hand is followed.
TEST(LinkEnds, StatesFollowTheToolWithinTheDeadband) {
  const auto packets_in_4s = [](double tremor_mm, double speed_mm_per_s) {
    LinkPair pair;
    pair.run(1s);
    Random random(3);
    CuttingState state;
    state.phase = CuttingPhase::free;
    const std::size_t before = pair.ups.size();
    double worst_mm = 0;
    for (int i = 0; i < 500; ++i) {
      ++state.state_seq;
      state.pose_bone_tool.position_mm = Vec3(speed_mm_per_s * i * 0.008, 0, 0) + random.in_cube(tremor_mm);
      state.pose_bone_device = state.pose_bone_tool;
      pair.client.set_state(state, 0);
      pair.run(8ms);
      if (const auto received = pair.server.take_state()) {
        EXPECT_EQ(received->state.author, AuthorId{7});
        EXPECT_LE(received->state.state_seq, state.state_seq);
        const std::vector<wire::KnownToolState> partners{*received};
        pair.server.set_partners(partners);
      }
      if (i < 10) continue;
      const auto partners = pair.client.partners(pair.now);
      EXPECT_EQ(partners.size(), 1u);
      for (const auto& partner : partners)
        worst_mm =
            std::max(worst_mm, (partner.state.pose_bone_tool.position_mm - state.pose_bone_tool.position_mm).norm());
    }
    std::printf("tremor %.3f mm, %.0f mm/s: %zu packets in 4 s, partner's picture off by %.3f mm at most\n", tremor_mm,
                speed_mm_per_s, pair.ups.size() - before, worst_mm);
    // At rest the error is at most the deadband and a quantum. A moving hand adds the distance of two intervals up, two
    // down, and the wait of this test.
    EXPECT_LE(worst_mm, 0.02 + 0.002 + speed_mm_per_s * 0.064);
    return pair.ups.size() - before;
  };
  const std::size_t resting = packets_in_4s(0, 0), trembling = packets_in_4s(0.005, 0), moving = packets_in_4s(0, 20);
  EXPECT_EQ(resting, trembling);
  EXPECT_LE(resting, 4 * 12u);
  EXPECT_GE(moving, 4 * 50u);
}

TEST(LinkEnds, FreezeAndEpochGetThroughAtOnce) {
  std::vector<double> took_ms;
  for (std::uint64_t seed = 1; seed <= trials(100); ++seed) {
    Trial trial({.seed = seed, .quality = hostile(40ms)});
    trial.time.run_until(2s);
    wire::ServerLink& server = trial.sessions[0]->link;
    const wire::ClientLink& client = trial.clients[0]->link;
    if (seed % 2 == 0)
      server.set_frozen(true);
    else
      server.set_lease_epoch(5);
    const Time at = trial.time.now();
    while (!client.frozen() && client.lease_epoch() != 5 && trial.time.now() < at + 2s)
      trial.time.run_until(trial.time.now() + 1ms);
    took_ms.push_back(ms(trial.time.now() - at));
    EXPECT_EQ(client.frozen(), seed % 2 == 0);
    EXPECT_EQ(client.lease_epoch(), seed % 2 == 0 ? 0u : 5u);
  }
  std::printf("frozen after p50 %.0f, most %.0f ms\n", share_of(took_ms, 0.5), share_of(took_ms, 1));
  EXPECT_LE(share_of(took_ms, 1), 50.0 + 30 + 10 * 8);
}

TEST(LinkEnds, KnowTheRoundTripTheClocksAndTheLoss) {
  Trial trial({.quality = hostile(40ms)});
  trial.time.run_until(500ms);
  trial.cut(true);
  trial.time.run_until(6s);
  const Time now = trial.time.now();
  for (std::size_t c = 0; c < Trial::kClients; ++c) {
    const auto clock = trial.clients[c]->link.clock(now), back = trial.sessions[c]->link.clock(now);
    ASSERT_TRUE(clock && back);
    for (const auto& reading : {*clock, *back}) {
      EXPECT_GE(reading.round_trip, 60ms);
      EXPECT_LE(reading.round_trip, 100ms);
      EXPECT_LE(std::abs(reading.offset.count()), (reading.error + 1us).count()) << "both clocks are one";
    }
    // 30 % are lost and 1 % corrupted. Smoothing covers 64 packets, so the bound is 4 sigma of sqrt(0.3 x 0.7 / 128).
    EXPECT_NEAR(trial.clients[c]->link.loss(), 0.307, 0.17);
    EXPECT_NEAR(trial.sessions[c]->link.loss(), 0.307, 0.17);
  }
}

}  // namespace
}  // namespace osteon
