#include "common/link/send_window.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "tests/support/network/sim_network.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/link/carrying.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using Numbers = std::vector<std::uint64_t>;

SendItem item(std::size_t bytes, std::size_t head = 0, std::uint64_t follows = 0) {
  return {std::string(bytes, 'b'), std::string(head, 'h'), follows};
}

TEST(SendWindow, NumbersItemsAndForgetsThemWhenAcknowledged) {
  SendWindow window({}, 7);
  EXPECT_TRUE(window.empty());
  EXPECT_EQ(window.push(item(10)), 7u);
  EXPECT_EQ(window.push(item(20)), 8u);
  EXPECT_EQ(window.bytes_unacknowledged(), 30u);
  EXPECT_FALSE(window.acknowledge(7)) << "item 7 was never sent";
  (void)window.pick(0s, 1000, 5);
  EXPECT_FALSE(window.acknowledge(6));
  EXPECT_FALSE(window.acknowledge(9));
  EXPECT_TRUE(window.acknowledge(7));
  EXPECT_FALSE(window.acknowledge(7)) << "item 7 is acknowledged already";
  EXPECT_EQ(window.oldest(), 8u);
  EXPECT_EQ(window.bytes_unacknowledged(), 20u);
  EXPECT_TRUE(window.acknowledge(8));
  EXPECT_TRUE(window.empty());
  EXPECT_EQ(window.push(item(1)), 9u);
}

TEST(SendWindow, RefusesWhatGoesBeyondItsLimits) {
  SendWindow bytes({100, 1000});
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(bytes.push(item(10)));
  EXPECT_FALSE(bytes.push(item(1)));
  EXPECT_EQ(bytes.counts().refused, 1u);
  SendWindow items({1000, 3});
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(items.push(item(1)));
  EXPECT_FALSE(items.push(item(1)));
  SendWindow large({100, 10});
  EXPECT_TRUE(large.push(item(500))) << "an empty window takes any item, otherwise the item could never be sent";
}

TEST(SendWindow, RepeatsEachItemInTheNextPacketsAndThenWaits) {
  SendWindow window;
  window.set_round_trip(200ms);
  std::map<std::uint64_t, int> sent;
  for (int packet = 0; packet < 20; ++packet) {
    if (packet < 3) window.push(item(10));
    for (const std::uint64_t number : window.pick(8ms * packet, 1000, 5).numbers) ++sent[number];
  }
  EXPECT_EQ(sent, (std::map<std::uint64_t, int>{{1, 5}, {2, 5}, {3, 5}}));
  EXPECT_EQ(window.counts().repeated, 12u);
  // The first item was last sent at 32 ms. It is due one retransmission time later, and not before.
  const auto due = 32ms + window.retransmission_time();
  EXPECT_GT(window.retransmission_time(), 200ms);
  EXPECT_EQ(window.next_due(160ms, 5), due);
  // Its acknowledgement is overdue one retransmission time after it was first sent.
  EXPECT_TRUE(window.pick(window.retransmission_time() - 1ns, 1000, 5).numbers.empty());
  EXPECT_EQ(window.pick(window.retransmission_time(), 1000, 5).numbers, Numbers{1});
  EXPECT_EQ(window.pick(window.retransmission_time() + 8ms, 1000, 5).numbers, Numbers{1})
      << "the item is in every packet from then on";
  EXPECT_EQ(window.pick(1s, 1000, 5).numbers, (Numbers{1, 2, 3}));
}

TEST(SendWindow, SaysWhenSomethingIsDue) {
  SendWindow window;
  EXPECT_FALSE(window.next_due(5s, 5));
  window.push(item(10));
  EXPECT_EQ(window.next_due(5s, 5), 5s);
  (void)window.pick(5s, 1000, 2);
  EXPECT_EQ(window.next_due(5s, 2), 5s);
  (void)window.pick(5s + 8ms, 1000, 2);
  EXPECT_EQ(window.next_due(5s + 8ms, 2), 5s + 8ms + window.retransmission_time());
  EXPECT_EQ(window.next_due(60s, 2), 60s);
}

TEST(SendWindow, PutsTheOverdueFirstThenTheNewInOrderThenTheLeastOftenSent) {
  SendWindow window;
  for (int i = 0; i < 6; ++i) window.push(item(10));
  EXPECT_EQ(window.pick(0s, 60, 5).numbers, (Numbers{1, 2, 3, 4, 5, 6}));
  window.push(item(10));
  window.push(item(10));
  // There is room for four: both new items, and the last two of the others.
  EXPECT_EQ(window.pick(8ms, 40, 5).numbers, (Numbers{5, 6, 7, 8}));
  window.push(item(10));
  // Items are overdue: the oldest is sent first.
  EXPECT_EQ(window.pick(1s, 20, 5).numbers, (Numbers{1, 9}));
  window.push(item(10));
  window.push(item(30));
  window.push(item(1));
  EXPECT_EQ(window.pick(1s + 8ms, 25, 5).numbers, (Numbers{1, 10}))
      << "12 must not be sent before 11, for which there is no room";
}

// Bytes counted by hand. An item needs a head if the item before it is not in the packet. The head is saved again if
// that item joins later.
TEST(SendWindow, CountsAHeadOnlyWhereARunBegins) {
  SendWindow window;
  window.push(item(10, 40));
  window.push(item(10, 40, 1));
  window.push(item(10, 40));  // It begins a new run.
  window.push(item(10, 40, 3));
  const auto all = window.pick(0s, 1000, 5);
  EXPECT_EQ(all.bytes, 4u * 10 + 2u * 40);
  EXPECT_TRUE(window.needs_head(1, all));
  EXPECT_FALSE(window.needs_head(2, all));
  EXPECT_TRUE(window.needs_head(3, all));
  EXPECT_FALSE(window.needs_head(4, all));
  // All were sent equally often, so they are picked from the end: 4 with its head needs 50 bytes, 3 joins for 10 more,
  // 2 would need 50 again.
  const auto two = window.pick(8ms, 109, 5);
  EXPECT_EQ(two.numbers, (Numbers{3, 4}));
  EXPECT_EQ(two.bytes, 60u);
  EXPECT_EQ(window.pick(16ms, 110, 5).numbers, (Numbers{2, 3, 4}));
}

TEST(SendWindow, DoesNotRepeatWhatHasArrivedAheadOfItsTurn) {
  SendWindow window;
  for (int i = 0; i < 6; ++i) window.push(item(10));
  EXPECT_FALSE(window.acknowledge(0, 1)) << "nothing was sent";
  (void)window.pick(0s, 1000, 5);
  window.push(item(10));
  // 1 arrived, 2 is missing, 3 and 5 arrived. The bits for 7, which was never sent, and beyond are ignored.
  EXPECT_TRUE(window.acknowledge(1, 0b11110101));
  EXPECT_FALSE(window.acknowledge(1, 0b101)) << "the acknowledgement has no news";
  EXPECT_FALSE(window.acknowledge(0, 0b10)) << "an older packet was overtaken: it is known that 3 arrived";
  EXPECT_EQ(window.pick(8ms, 1000, 5).numbers, (Numbers{2, 4, 6, 7}));
  EXPECT_EQ(window.items_unacknowledged(), 6u);
  EXPECT_EQ(window.pick(2s, 1000, 5).numbers, (Numbers{2, 4, 6, 7}));
  EXPECT_TRUE(window.acknowledge(7));
  EXPECT_FALSE(window.next_due(3s, 5));
}

TEST(SendWindow, SendsAllAgainToARestartedEndpoint) {
  SendWindow window;
  for (int i = 0; i < 6; ++i) window.push(item(10));
  (void)window.pick(0s, 1000, 5);
  window.acknowledge(2, 0b110);
  EXPECT_FALSE(window.restart(1)) << "the peer has lost what it had acknowledged";
  EXPECT_FALSE(window.restart(7)) << "item 7 was never pushed";
  EXPECT_TRUE(window.restart(3));
  EXPECT_FALSE(window.acknowledge(4)) << "item 4 was not sent since";
  EXPECT_EQ(window.pick(8ms, 20, 1).numbers, (Numbers{4, 5}));
  EXPECT_EQ(window.pick(8ms, 1000, 1).numbers, (Numbers{6}));
  EXPECT_TRUE(window.restart(6));
  EXPECT_TRUE(window.empty());
}

// With the room that least_room() reports, pick() takes the overdue items and at least one that was never sent.
TEST(SendWindow, SaysHowMuchRoomItNeeds) {
  SendWindow window({1 << 20, 100, 6});
  EXPECT_EQ(window.least_room(0s), 0u);
  window.push(item(500, 40));
  EXPECT_EQ(window.least_room(0s), 546u);
  EXPECT_TRUE(window.pick(0s, 545, 5).numbers.empty());
  EXPECT_EQ(window.pick(0s, 546, 5).numbers, Numbers{1});
  EXPECT_EQ(window.least_room(0s), 0u);
  window.push(item(300));
  EXPECT_EQ(window.least_room(1ms), 300u);
  EXPECT_EQ(window.least_room(1s), 846u) << "item 1 is overdue";
  EXPECT_EQ(window.pick(1s, 846, 5).numbers, (Numbers{1, 2}));
}

// In any case: the budget holds, new items are sent without a gap, and no acknowledged item is sent again. The bytes
// are those of the items, and of one head for each item that misses its predecessor.
TEST(SendWindow, KeepsItsPromisesUnderAnythingThatIsAskedOfIt) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    test::Random random(seed);
    SendWindow window({2000, 50});
    std::map<std::uint64_t, SendItem> known;
    std::uint64_t acknowledged = 0, newest_sent = 0;
    SendWindow::Time now{};
    for (int step = 0; step < 300; ++step) {
      now += std::chrono::milliseconds(random.index(20));
      if (random.unit() < 0.7) {
        const std::uint64_t next = window.next();
        const SendItem one = item(random.index(60), random.index(50), random.unit() < 0.8 ? next - 1 : 0);
        if (const auto number = window.push(one)) known[*number] = one;
      }
      if (random.unit() < 0.3) {
        const std::uint64_t upto = random.index(known.size() + 3);
        const std::uint64_t beyond = random.unit() < 0.5 ? 0 : random.index(16);
        const bool news = window.acknowledge(upto, beyond);
        if (upto > acknowledged && upto <= newest_sent)
          acknowledged = upto;
        else if (beyond == 0) {
          EXPECT_FALSE(news);
        }
        EXPECT_EQ(window.oldest(), acknowledged + 1);
      }
      const std::size_t budget = random.index(400);
      const auto picked = window.pick(now, budget, 1 + static_cast<int>(random.index(8)));
      std::size_t bytes = 0;
      for (std::size_t i = 0; i < picked.numbers.size(); ++i) {
        const std::uint64_t number = picked.numbers[i];
        ASSERT_GT(number, acknowledged);
        if (number > newest_sent) {
          ASSERT_EQ(number, newest_sent + 1);
          newest_sent = number;
        }
        const SendItem& one = known.at(number);
        const bool joined = one.follows != 0 && i > 0 && picked.numbers[i - 1] == one.follows;
        ASSERT_EQ(window.needs_head(number, picked), !joined);
        bytes += one.bytes.size() + (joined ? 0 : one.head.size());
      }
      ASSERT_EQ(picked.bytes, bytes);
      ASSERT_LE(bytes, budget);
      ASSERT_LE(window.items_unacknowledged(), 50u);
      ASSERT_LE(window.bytes_unacknowledged(), 2000u);
    }
  }
}

struct Carried {
  double p50_ms = 0, p99_ms = 0, p999_ms = 0, bytes_per_item = 0, kbit_per_s = 0;
};

// 125 items a second of 10 bytes (heads 36) for 11 s, one way, at 30 % loss, 10 % reorder, 5 % duplication and +-10 ms.
Carried carry(std::chrono::nanoseconds one_way, double kbit_per_s, int repeats, std::uint64_t seeds) {
  std::vector<double> delays_ms;
  double bytes = 0, said = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    test::VirtualTime time;
    test::SimNetwork network(time, seed);
    test::PathQuality bad;
    bad.loss = 0.3;
    bad.reorder = 0.1;
    bad.duplicate = 0.05;
    bad.delay = one_way;
    bad.jitter = 10ms;
    network.set_quality(bad);
    const auto near = network.open(test::node(1)), far = network.open(test::node(2));
    test::PeerParams params;
    params.repeats = repeats;
    params.rate.bytes_per_s = kbit_per_s * 1000.0 / 8.0;
    std::deque<SendWindow::Time> made;
    test::Peer<> sender(*near, far->local(), params, [](std::string) {});
    params.repeats = 0;
    test::Peer<> receiver(*far, near->local(), params, [&](std::string) {
      delays_ms.push_back(std::chrono::duration<double, std::milli>(time.now() - made.front()).count());
      made.pop_front();
    });
    DatagramBuffer buffer;
    for (auto t = 0ms; t < 15s; t += 1ms) {
      time.run_until(t);
      if (t % 8ms == 0ms && t >= 1s && t < 12s) {
        if (sender.say(std::string(10, 'b'), std::string(36, 'h'), t > 1s)) made.push_back(t);
        ++said;
      }
      while (const auto got = near->receive(buffer)) sender.heard(*got, t);
      while (const auto got = far->receive(buffer)) receiver.heard(*got, t);
      sender.step(t);
      receiver.step(t);
    }
    bytes += static_cast<double>(sender.extremes().bytes);
  }
  EXPECT_EQ(static_cast<double>(delays_ms.size()), said) << "all pushed items arrived";
  std::ranges::sort(delays_ms);
  const auto share = [&](double of) {
    return delays_ms.at(static_cast<std::size_t>(of * static_cast<double>(delays_ms.size() - 1)));
  };
  return {share(0.5), share(0.99), share(0.999), bytes / said,
          bytes * 8.0 / 1000.0 / (14.0 * static_cast<double>(seeds))};
}

// The effect of k and the budget on the delay until an item is passed on in order. SendRate's choice is based on these
// columns.
TEST(SendWindow, Table) {
  for (const auto one_way : {40ms, 100ms}) {
    std::map<int, Carried> wide;
    Carried short_of_bytes;
    for (const double kbit : {300.0, 200.0}) {
      for (const int k : {2, 3, 4, 5, 6, 7, 8, 10, 12, 0}) {
        const Carried c = carry(one_way, kbit, k, 8);
        if (kbit == 300.0)
          wide[k] = c;
        else
          short_of_bytes = c;
        std::printf("one way %3lld ms, %3.0f kbit/s, k %2s: ", static_cast<long long>(one_way.count()), kbit,
                    k == 0 ? "-" : std::to_string(k).c_str());
        std::printf("delay p50 %4.0f p99 %4.0f p99.9 %4.0f ms, %3.0f B an item, %3.0f kbit/s\n", c.p50_ms, c.p99_ms,
                    c.p999_ms, c.bytes_per_item, c.kbit_per_s);
        EXPECT_LE(c.kbit_per_s, kbit);
      }
    }
    const double way_ms = std::chrono::duration<double, std::milli>(one_way).count();
    // The wait of a round trip has the probability p^k R/T. At k = 5 and 100 ms these are 6 % of the items, so the 99th
    // percentile waits. At k = 10 they are 0.01 %, so it does not.
    if (one_way == 100ms) {
      EXPECT_GT(wide[5].p99_ms, 2.0 * way_ms);
    }
    EXPECT_GT(wide[3].p99_ms, 2.0 * way_ms);
    // Four packets in succession are lost once in 123 times. Then the fifth brings the item, 32 ms later.
    EXPECT_LT(wide[10].p99_ms, way_ms + 10.0 + 5.0 * 8.0);
    EXPECT_LT(wide[0].p99_ms, way_ms + 10.0 + 5.0 * 8.0) << "with the k that SendRate chooses";
    // With two thirds of the bytes, packets are sent every 11 ms.
    EXPECT_LT(short_of_bytes.p99_ms, way_ms + 10.0 + 6.0 * 11.0);
  }
}

}  // namespace
}  // namespace osteon
