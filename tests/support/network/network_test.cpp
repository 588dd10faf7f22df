#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "tests/support/network/sim_network.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using Time = VirtualTime::Time;

TEST(VirtualTime, RunsInOrderOfTimeAndOfPosting) {
  VirtualTime time;
  std::string ran;
  time.post(20ms, [&] { ran += 'c'; });
  time.post(10ms, [&] {
    ran += 'a';
    time.post_in(0ms, [&] { ran += 'x'; });
    time.post(5ms, [&] { ran += 'y'; });  // is in the past: runs at once, after what was posted before
    time.post(30ms, [&] { ran += 'd'; });
  });
  time.post(10ms, [&] { ran += 'b'; });
  time.run_until(20ms);
  EXPECT_EQ(ran, "abxyc");
  EXPECT_EQ(time.now(), 20ms);
  time.run_until(25ms);
  EXPECT_EQ(time.now(), 25ms);
  EXPECT_TRUE(time.run_next());
  EXPECT_EQ(time.now(), 30ms);
  EXPECT_FALSE(time.run_next());
  EXPECT_EQ(ran, "abxycd");
}

// What arrived: which datagram, when, from where.
struct Arrival {
  std::string text;
  Time at;
  bool operator==(const Arrival&) const = default;
};

std::vector<Arrival> send_each_8ms(SimNetwork& network, VirtualTime& time, int count, std::size_t bytes = 64) {
  const auto from = network.open(node(1)), to = network.open(node(2));
  std::vector<Arrival> arrivals;
  DatagramBuffer buffer;
  to->on_arrival([&] {
    while (const auto got = to->receive(buffer)) {
      EXPECT_EQ(got->from, node(1));
      arrivals.push_back({{got->bytes.begin(), got->bytes.end()}, time.now()});
    }
  });
  const Time start = time.now();
  for (int i = 0; i < count; ++i) {
    time.run_until(start + i * 8ms);
    std::string text = std::to_string(i);
    text.resize(bytes, ' ');
    from->send(node(2), {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }
  time.run_until(time.now() + 10s);
  return arrivals;
}

TEST(SimNetwork, AGoodOneDeliversAllInOrderAtOnce) {
  VirtualTime time;
  SimNetwork network(time, 1);
  const auto arrivals = send_each_8ms(network, time, 100);
  ASSERT_EQ(arrivals.size(), 100u);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(std::stoi(arrivals[static_cast<std::size_t>(i)].text), i);
    EXPECT_EQ(arrivals[static_cast<std::size_t>(i)].at, i * 8ms);
  }
}

PathQuality hostile() {
  PathQuality bad;
  bad.loss = 0.3;
  bad.reorder = 0.1;
  bad.duplicate = 0.05;
  bad.corrupt = 0.02;
  bad.delay = 100ms;
  bad.jitter = 10ms;
  return bad;
}

TEST(SimNetwork, ASeedGivesTheSameFateAndAnotherAnother) {
  const auto run = [](std::uint64_t seed) {
    VirtualTime time;
    SimNetwork network(time, seed);
    network.set_quality(hostile());
    return send_each_8ms(network, time, 500);
  };
  EXPECT_EQ(run(7), run(7));
  EXPECT_NE(run(7), run(8));
}

// Shares within 4 standard deviations of those requested, delays within their bounds.
TEST(SimNetwork, DoesToDatagramsWhatItWasAskedTo) {
  VirtualTime time;
  SimNetwork network(time, 3);
  network.set_quality(hostile());
  constexpr int kSent = 20000;
  const auto arrivals = send_each_8ms(network, time, kSent);
  const NetworkCounts counts = network.counts();
  const auto near = [](std::uint64_t count, double of, double share) {
    EXPECT_NEAR(static_cast<double>(count), of * share, 4.0 * std::sqrt(of * share * (1 - share)));
  };
  near(counts.paths.lost, kSent, 0.3);
  const auto alive = static_cast<double>(kSent - counts.paths.lost);
  near(counts.paths.duplicated, alive, 0.05);
  near(counts.paths.held_back, alive, 0.1);
  near(counts.paths.corrupted, alive, 0.02);
  EXPECT_EQ(counts.delivered, kSent - counts.paths.lost + counts.paths.duplicated);
  EXPECT_EQ(arrivals.size(), counts.delivered);
  const auto spoiled = std::ranges::count_if(arrivals, [](const Arrival& arrival) {
    return !std::ranges::all_of(arrival.text, [](char c) { return c == ' ' || (c >= '0' && c <= '9'); });
  });
  EXPECT_GT(spoiled, 100);

  PathQuality clean = hostile();
  clean.corrupt = 0;
  network.set_quality(clean);
  const Time start = time.now();
  int overtaken = 0, newest = -1;
  for (const Arrival& arrival : send_each_8ms(network, time, kSent)) {
    const int number = std::stoi(arrival.text);
    const Time took = arrival.at - start - number * 8ms;
    EXPECT_GE(took, 90ms);
    EXPECT_LE(took, 110ms + 2 * 30ms);
    if (number < newest) ++overtaken;
    newest = std::max(newest, number);
  }
  EXPECT_GT(overtaken, 500) << "held back, or a second copy";
  std::printf("%d sent: %llu lost, %llu twice, %llu held back, %llu spoiled; %d overtaken\n", kSent,
              static_cast<unsigned long long>(counts.paths.lost),
              static_cast<unsigned long long>(counts.paths.duplicated),
              static_cast<unsigned long long>(counts.paths.held_back),
              static_cast<unsigned long long>(counts.paths.corrupted), overtaken);
}

TEST(SimNetwork, JitterAloneKeepsTheOrder) {
  VirtualTime time;
  SimNetwork network(time, 5);
  PathQuality jitter;
  jitter.delay = 50ms;
  jitter.jitter = 40ms;
  network.set_quality(jitter);
  const auto arrivals = send_each_8ms(network, time, 1000);
  ASSERT_EQ(arrivals.size(), 1000u);
  for (std::size_t i = 0; i < arrivals.size(); ++i) EXPECT_EQ(std::stoul(arrivals[i].text), i);
}

TEST(SimNetwork, APartitionLosesWhatIsSentInIt) {
  VirtualTime time;
  SimNetwork network(time, 5);
  network.partition(node(1), node(2), 80ms, 160ms);
  network.partition(node(1), node(3), 0ms, 10s);
  network.partition(400ms, 480ms);
  const auto arrivals = send_each_8ms(network, time, 100);
  EXPECT_EQ(arrivals.size(), 80u);
  EXPECT_EQ(network.counts().cut_off, 20u);
  for (const Arrival& arrival : arrivals) {
    EXPECT_FALSE(arrival.at >= 80ms && arrival.at < 160ms);
    EXPECT_FALSE(arrival.at >= 400ms && arrival.at < 480ms);
  }
}

// 64 bytes each 8 ms are 8000 bytes/s; 4000 pass, one queue of 1024 bytes waits, and the rest is lost.
TEST(SimNetwork, ANarrowPathQueuesAndThenLoses) {
  VirtualTime time;
  SimNetwork network(time, 5);
  PathQuality narrow;
  narrow.bytes_per_s = 4000;
  narrow.queue_bytes = 1024;
  network.set_quality(narrow);
  const auto arrivals = send_each_8ms(network, time, 1000);
  const double expected = (8.0 * 4000 + 1024) / 64;
  EXPECT_NEAR(static_cast<double>(arrivals.size()), expected, 2.0);
  EXPECT_EQ(network.counts().paths.overflowed, 1000 - arrivals.size());
  for (std::size_t i = 1; i < arrivals.size(); ++i) EXPECT_GE(arrivals[i].at - arrivals[i - 1].at, 16ms - 1us);
  const Time waited = arrivals.back().at - std::stoi(arrivals.back().text) * 8ms;
  EXPECT_LE(waited, 256ms);
  EXPECT_GE(waited, 220ms);
}

TEST(SimNetwork, OneDirectionMayBeWorse) {
  VirtualTime time;
  SimNetwork network(time, 5);
  PathQuality deaf;
  deaf.loss = 1.0;
  network.set_quality(node(2), node(1), deaf);
  EXPECT_EQ(send_each_8ms(network, time, 10).size(), 10u);
  const auto a = network.open(node(1)), b = network.open(node(2));
  DatagramBuffer buffer;
  b->send(node(1), {});
  b->send(node(9), {});
  time.run_until(time.now() + 1s);
  EXPECT_FALSE(a->receive(buffer));
  EXPECT_EQ(network.counts().unreachable, 1u);
}

}  // namespace
}  // namespace osteon::test
