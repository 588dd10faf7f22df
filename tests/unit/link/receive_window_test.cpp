#include "common/link/receive_window.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <set>
#include <string>
#include <vector>

#include "tests/support/scenes/random.hpp"

namespace osteon {
namespace {

TEST(ReceiveWindow, GivesEachItemOnceInOrder) {
  ReceiveWindow<std::string> window;
  EXPECT_FALSE(window.take());
  EXPECT_EQ(window.acknowledged(), 0u);
  EXPECT_TRUE(window.insert(2, "b"));
  EXPECT_FALSE(window.take()) << "1 is missing";
  EXPECT_TRUE(window.insert(1, "a"));
  EXPECT_FALSE(window.insert(2, "other")) << "the first item with this number is kept";
  EXPECT_EQ(window.acknowledged(), 0u) << "nothing was taken yet";
  EXPECT_EQ(window.take(), "a");
  EXPECT_EQ(window.take(), "b");
  EXPECT_FALSE(window.take());
  EXPECT_EQ(window.acknowledged(), 2u);
  EXPECT_FALSE(window.insert(1, "a"));
  EXPECT_FALSE(window.insert(0, "x"));
  EXPECT_EQ(window.counts().repeated, 3u);
  EXPECT_EQ(window.counts().taken, 2u);
}

TEST(ReceiveWindow, DropsWhatIsTooFarAhead) {
  ReceiveWindow<int> window(10, 4);
  EXPECT_TRUE(window.insert(13, 13));
  EXPECT_FALSE(window.insert(14, 14));
  EXPECT_FALSE(window.insert(~std::uint64_t{0}, 0));
  EXPECT_EQ(window.counts().beyond, 2u);
  EXPECT_TRUE(window.insert(10, 10));
  EXPECT_EQ(window.take(), 10);
  EXPECT_TRUE(window.insert(14, 14)) << "the window has moved by one";
  EXPECT_EQ(window.held(), 2u);
}

// Compared with the set of the offered numbers, one by one.
TEST(ReceiveWindow, ReportsWhatWasReceivedBeyondTheMissing) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    test::Random random(seed);
    ReceiveWindow<int> window;
    std::set<std::uint64_t> come;
    for (int i = 0; i < 100; ++i) {
      const std::uint64_t number = 1 + random.index(150);
      window.insert(number, 0);
      come.insert(number);
      while (random.unit() < 0.9 && window.take()) {
      }
      const std::uint64_t upto = random.unit() < 0.5 ? window.acknowledged() : random.index(window.acknowledged() + 1);
      std::uint64_t expected = 0;
      for (int bit = 0; bit < 64; ++bit)
        if (come.contains(upto + 2 + static_cast<std::uint64_t>(bit))) expected |= std::uint64_t{1} << bit;
      ASSERT_EQ(window.beyond(upto), expected) << "seed " << seed;
    }
  }
}

// Any order and repetition of packets with neighbouring items gives 1, 2, 3, ... and nothing twice. The window never
// holds more than the bound. Packets arrive until all items have.
TEST(ReceiveWindow, AnyOrderAndRepetitionGivesTheSameSequence) {
  std::uint64_t offers = 0;
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    test::Random random(seed);
    const std::uint64_t count = 1 + random.index(120), first = random.unit() < 0.5 ? 1 : random.index(1'000'000);
    const std::uint64_t most_ahead = 1 + random.index(40);
    ReceiveWindow<std::uint64_t> window(first, most_ahead);
    std::vector<std::uint64_t> taken;
    while (taken.size() < count) {
      const std::uint64_t from = first + random.index(count), length = 1 + random.index(8);
      for (std::uint64_t n = from; n < std::min(from + length, first + count); ++n, ++offers) window.insert(n, n * 7);
      ASSERT_LE(window.held(), most_ahead);
      if (random.unit() < 0.5) continue;  // these are taken later
      while (const auto item = window.take()) taken.push_back(*item);
      ASSERT_EQ(window.acknowledged(), first - 1 + taken.size());
    }
    ASSERT_EQ(taken.size(), count);
    for (std::uint64_t i = 0; i < count; ++i) ASSERT_EQ(taken[i], (first + i) * 7) << "seed " << seed;
    EXPECT_EQ(window.counts().taken, count);
  }
  std::printf("%llu items offered\n", static_cast<unsigned long long>(offers));
}

// Items that were received over the other transport are not given out, and do not delay the items behind them.
TEST(ReceiveWindow, WhatIsSkippedIsPassedOver) {
  ReceiveWindow<int> window(1, 8);
  EXPECT_TRUE(window.insert(2, 2));
  EXPECT_TRUE(window.insert(5, 5));
  window.skip(3);
  EXPECT_EQ(window.acknowledged(), 3u);
  EXPECT_EQ(window.held(), 1u);
  EXPECT_EQ(window.beyond(3), 1u);
  EXPECT_FALSE(window.insert(3, 3));
  EXPECT_FALSE(window.take());
  window.skip(2);
  EXPECT_TRUE(window.insert(4, 4));
  EXPECT_EQ(window.take(), 4);
  EXPECT_EQ(window.take(), 5);
  window.skip(1'000'000);
  EXPECT_TRUE(window.insert(1'000'001, 6));
  EXPECT_EQ(window.take(), 6);
}

}  // namespace
}  // namespace osteon
