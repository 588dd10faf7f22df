// Two authors and a server on a hostile network: the promises of the windows and the rate together.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <memory>
#include <vector>

#include "tests/support/network/sim_network.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/link/carrying.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using Time = VirtualTime::Time;

struct Outcome {
  bool each_once_in_order =
      // the server has the cuts 1, 2, 3, ... of each author, and every author has the server's entries
      true;
  bool complete = false;  // and all of them, within the quiet time
  std::size_t cuts = 0, refused = 0;
  Time quiet_until_complete{};
  std::vector<double> felt_ms;  // from a cut until the other author has received it
  PeerExtremes worst;
  double worst_kbit_per_s = 0;
  NetworkCounts network;
};

// Authors cut every 8 ms for 2 s, with pauses. The server orders the cuts that it takes and sends them to both.
template <class Receive>
Outcome carry(std::uint64_t seed, const PathQuality& quality, bool with_partition) {
  VirtualTime time;
  SimNetwork network(time, seed);
  network.set_quality(quality);
  if (with_partition) network.partition(node(2), node(1), 800ms, 1600ms);
  Random random(seed);
  Outcome outcome;

  struct Row {
    int author;
    std::uint64_t number;
  };
  std::vector<Row> entries;                   // in the order of the server
  std::array<std::uint64_t, 2> last_entry{};  // newest entry of each author, in both down windows
  std::array<std::vector<Time>, 2> made;      // by number - 1
  std::array<std::uint64_t, 2> taken{};       // number of cuts that the server has of each author
  std::array<std::size_t, 2> known{};         // number of entries that each author has
  std::array<bool, 2> pausing{};

  const std::array<std::unique_ptr<SimPort>, 2> server_ports{network.open(node(1, 1)), network.open(node(1, 2))};
  const std::array<std::unique_ptr<SimPort>, 2> ports{network.open(node(2)), network.open(node(3))};
  std::array<std::unique_ptr<Peer<Receive>>, 2> servers, authors;
  PeerParams up, down;
  down.rate.bytes_per_s = 600'000.0 / 8.0;
  for (std::size_t a = 0; a < 2; ++a) {
    servers[a] =
        std::make_unique<Peer<Receive>>(*server_ports[a], ports[a]->local(), down, [&, a](const std::string& cut) {
          const std::uint64_t number = std::stoull(cut);
          if (number != ++taken[a]) outcome.each_once_in_order = false;
          entries.push_back({static_cast<int>(a), number});
          std::string text = std::to_string(a) + " " + std::to_string(number);
          text.resize(12, ' ');
          for (const auto& server : servers) {
            // An entry is joined to the author's last entry only if that is the entry before. A real packet joins
            // entries also across others.
            const bool follows = last_entry[a] != 0 && last_entry[a] + 1 == entries.size();
            if (!server->say(text, std::string(40, 'h'), follows)) outcome.each_once_in_order = false;
          }
          last_entry[a] = entries.size();
        });
    authors[a] =
        std::make_unique<Peer<Receive>>(*ports[a], server_ports[a]->local(), up, [&, a](const std::string& entry) {
          const int author = entry[0] - '0';
          const std::uint64_t number = std::stoull(entry.substr(2));
          const std::size_t at = known[a]++;
          if (at >= entries.size() || entries[at].author != author || entries[at].number != number)
            outcome.each_once_in_order = false;
          else if (author != static_cast<int>(a)) {
            const Time since = made[static_cast<std::size_t>(author)][number - 1];
            outcome.felt_ms.push_back(std::chrono::duration<double, std::milli>(time.now() - since).count());
          }
        });
  }

  const Time input_ends = 2s;
  DatagramBuffer buffer;
  for (Time t{}; t < input_ends + 4s; t += 1ms) {
    time.run_until(t);
    for (std::size_t a = 0; a < 2; ++a) {
      if (t < input_ends && t % 8ms == 0ms) {
        if (random.unit() < 0.02) pausing[a] = !pausing[a];
        if (!pausing[a]) {
          std::string cut = std::to_string(made[a].size() + 1);
          cut.resize(10, ' ');
          if (authors[a]->say(cut, std::string(36, 'h'), !made[a].empty()))
            made[a].push_back(t);
          else
            ++outcome.refused;
        }
      }
      for (const auto* side : {&authors, &servers}) {
        const SimPort& port = side == &authors ? *ports[a] : *server_ports[a];
        while (const auto got = const_cast<SimPort&>(port).receive(buffer)) (*side)[a]->heard(*got, t);
        (*side)[a]->step(t);
      }
    }
    const std::size_t cuts = made[0].size() + made[1].size();
    if (t >= input_ends && known[0] == cuts && known[1] == cuts && entries.size() == cuts) {
      outcome.complete = true;
      outcome.quiet_until_complete = t - input_ends;
      break;
    }
  }
  outcome.cuts = made[0].size() + made[1].size();
  for (const auto* side : {&authors, &servers}) {
    for (const auto& peer : *side) {
      const PeerExtremes& seen = peer->extremes();
      outcome.worst.waiting_bytes = std::max(outcome.worst.waiting_bytes, seen.waiting_bytes);
      outcome.worst.held = std::max(outcome.worst.held, seen.held);
      outcome.worst.datagram = std::max(outcome.worst.datagram, seen.datagram);
      if (side == &authors) {
        const double s = std::chrono::duration<double>(time.now()).count();
        // The burst is allowed once in addition to the rate.
        const double kbit = (static_cast<double>(seen.bytes) - 2256.0) * 8.0 / 1000.0;
        outcome.worst_kbit_per_s = std::max(outcome.worst_kbit_per_s, kbit / s);
      }
    }
  }
  outcome.network = network.counts();
  return outcome;
}

PathQuality hostile() {
  PathQuality bad;
  bad.loss = 0.3;
  bad.reorder = 0.1;
  bad.duplicate = 0.05;
  bad.delay = 100ms;
  bad.jitter = 10ms;
  return bad;
}

constexpr std::uint64_t kSeeds = 300;

TEST(Carrying, EveryCutArrivesOnceAndInOrderWhateverTheNetworkDoes) {
  std::size_t cuts = 0;
  std::uint64_t sent = 0, lost = 0;
  std::vector<double> felt_ms;
  PeerExtremes worst;
  double worst_kbit = 0;
  Time longest{};
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Outcome outcome = carry<ReceiveWindow<std::string>>(seed, hostile(), seed % 3 == 0);
    ASSERT_TRUE(outcome.each_once_in_order) << "seed " << seed;
    ASSERT_TRUE(outcome.complete) << "seed " << seed;
    EXPECT_EQ(outcome.refused, 0u) << "seed " << seed;
    cuts += outcome.cuts;
    sent += outcome.network.sent;
    lost += outcome.network.paths.lost + outcome.network.cut_off;
    if (seed % 3 != 0) felt_ms.insert(felt_ms.end(), outcome.felt_ms.begin(), outcome.felt_ms.end());
    worst.waiting_bytes = std::max(worst.waiting_bytes, outcome.worst.waiting_bytes);
    worst.held = std::max(worst.held, outcome.worst.held);
    worst.datagram = std::max(worst.datagram, outcome.worst.datagram);
    worst_kbit = std::max(worst_kbit, outcome.worst_kbit_per_s);
    longest = std::max(longest, outcome.quiet_until_complete);
  }
  std::ranges::sort(felt_ms);
  const auto share = [&](double of) {
    return felt_ms.at(static_cast<std::size_t>(of * static_cast<double>(felt_ms.size() - 1)));
  };
  std::printf(
      "%llu seeds: %zu cuts, %llu datagrams, %llu lost; most waiting %zu bytes, held %zu, datagram %zu bytes; %.0f "
      "kbit/s "
      "up; ",
      static_cast<unsigned long long>(kSeeds), cuts, static_cast<unsigned long long>(sent),
      static_cast<unsigned long long>(lost), worst.waiting_bytes, worst.held, worst.datagram, worst_kbit);
  std::printf("all there %lld ms after the last cut; felt after p50 %.0f p99 %.0f max %.0f ms\n",
              static_cast<long long>(longest / 1ms), share(0.5), share(0.99), felt_ms.back());
  EXPECT_LE(worst.waiting_bytes, 16u * 1024);
  EXPECT_LE(worst.held, 1024u);
  EXPECT_LE(worst.datagram, kMostDatagramBytes);
  EXPECT_LE(worst_kbit, 300.0);
  // Two ways of at most 110 ms, twice 30 ms held back, and the repeats, but no further round trip.
  EXPECT_LT(share(0.99), 2 * 110.0 + 2 * 30.0 + 10 * 8.0);
  EXPECT_LT(longest, 2s);
}

TEST(Carrying, AGoodNetworkNeedsLittle) {
  PathQuality good;
  good.delay = 1ms;
  const Outcome outcome = carry<ReceiveWindow<std::string>>(1, good, false);
  EXPECT_TRUE(outcome.each_once_in_order && outcome.complete);
  EXPECT_LT(outcome.quiet_until_complete, 20ms);
  EXPECT_LE(*std::ranges::max_element(outcome.felt_ms), 2.0 + 2 * 8.0 + 2.0);
}

// Items longer than the rate usually allows for a packet.
TEST(Carrying, LongItemsGoThroughASmallRate) {
  VirtualTime time;
  SimNetwork network(time, 1);
  network.set_quality(hostile());
  const auto near = network.open(node(1)), far = network.open(node(2));
  PeerParams params;
  params.rate.bytes_per_s = 10'000;
  std::size_t taken = 0;
  Peer<> sender(*near, far->local(), params, [](const std::string&) {});
  Peer<> receiver(*far, near->local(), params,
                  [&](const std::string& text) { EXPECT_EQ(text.size(), 20 + 23 * (taken++ % 10)); });
  DatagramBuffer buffer;
  std::size_t said = 0;
  for (Time t{}; t < 60s; t += 1ms) {
    time.run_until(t);
    if (t < 30s && t % 250ms == 0ms &&
        sender.say(std::string(20 + 23 * (said % 10), 'x'), std::string(36, 'h'), said > 0))
      ++said;
    while (const auto got = near->receive(buffer)) sender.heard(*got, t);
    while (const auto got = far->receive(buffer)) receiver.heard(*got, t);
    sender.step(t);
    receiver.step(t);
  }
  EXPECT_GT(said, 100u);
  EXPECT_EQ(taken, said);
}

// A faulty window that passes on items repeatedly.
struct WithoutDedup {
  explicit WithoutDedup(std::uint64_t first, std::uint64_t most_ahead) : window(first, most_ahead) {}
  bool insert(std::uint64_t number, std::string item) {
    if (number <= window.acknowledged()) {
      again.push_back(std::move(item));
      return true;
    }
    return window.insert(number, std::move(item));
  }
  std::optional<std::string> take() {
    if (again.empty()) return window.take();
    std::optional<std::string> item(std::move(again.back()));
    again.pop_back();
    return item;
  }
  [[nodiscard]] std::uint64_t acknowledged() const { return window.acknowledged(); }
  [[nodiscard]] std::uint64_t beyond(std::uint64_t upto) const { return window.beyond(upto); }
  [[nodiscard]] std::size_t held() const { return window.held(); }
  ReceiveWindow<std::string> window;
  std::vector<std::string> again;
};

// A faulty window that passes on each item once, but as it arrives.
struct WithoutOrder {
  explicit WithoutOrder(std::uint64_t first, std::uint64_t) : next(first) {}
  bool insert(std::uint64_t number, std::string item) {
    if (!seen.emplace(number, true).second) return false;
    waiting.push_back(std::move(item));
    while (seen.contains(next)) ++next;
    return true;
  }
  std::optional<std::string> take() {
    if (waiting.empty()) return {};
    std::optional<std::string> item(std::move(waiting.front()));
    waiting.erase(waiting.begin());
    return item;
  }
  [[nodiscard]] std::uint64_t acknowledged() const { return next - 1; }
  [[nodiscard]] std::uint64_t beyond(std::uint64_t) const { return 0; }
  [[nodiscard]] std::size_t held() const { return waiting.size(); }
  std::uint64_t next;
  std::map<std::uint64_t, bool> seen;
  std::vector<std::string> waiting;
};

template <class Broken>
int seeds_that_fail() {
  int failed = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Outcome outcome = carry<Broken>(seed, hostile(), true);
    if (!outcome.each_once_in_order || !outcome.complete) ++failed;
  }
  return failed;
}

TEST(Carrying, SeesThatRepeatsAreLetThrough) { EXPECT_EQ(seeds_that_fail<WithoutDedup>(), 20); }
TEST(Carrying, SeesThatTheOrderIsLost) { EXPECT_EQ(seeds_that_fail<WithoutOrder>(), 20); }

}  // namespace
}  // namespace osteon::test
