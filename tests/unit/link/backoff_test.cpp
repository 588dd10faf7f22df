#include "common/link/backoff.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace osteon {
namespace {

using namespace std::chrono_literals;
using Time = std::chrono::nanoseconds;

TEST(Backoff, StaysUnderALimitThatDoublesUpToItsBound) {
  const Time limits[] = {200ms, 400ms, 800ms, 1600ms, 3200ms, 5s, 5s, 5s};
  std::vector<Time> longest(std::size(limits), 0s);
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    Backoff backoff(seed);
    for (std::size_t i = 0; i < std::size(limits); ++i) {
      const Time wait = backoff.next();
      EXPECT_GE(wait, 100ms);
      EXPECT_LE(wait, limits[i]);
      longest[i] = std::max(longest[i], wait);
    }
  }
  // Of 1000 uniform draws the longest is within 2 % of the limit, except with a probability of 10^-8.
  for (std::size_t i = 0; i < std::size(limits); ++i) EXPECT_GE(longest[i], 0.98 * limits[i]) << i;
}

TEST(Backoff, SpreadsClientsEvenly) {
  // Kolmogorov's distance of 4000 first waits from a uniform distribution. It exceeds 1.95 / sqrt(n) with a probability
  // of 0.1 %.
  std::vector<double> waits;
  for (std::uint64_t seed = 0; seed < 4000; ++seed)
    waits.push_back((Backoff(seed).next() - Time(100ms)) / 1.0ms / 100.0);
  std::ranges::sort(waits);
  double distance = 0;
  for (std::size_t i = 0; i < waits.size(); ++i)
    distance =
        std::max(distance, std::abs(waits[i] - (static_cast<double>(i) + 0.5) / static_cast<double>(waits.size())));
  EXPECT_LT(distance, 1.95 / std::sqrt(4000.0));
}

TEST(Backoff, BeginsAnewAfterSuccessAndFollowsFromItsSeed) {
  Backoff first(7), second(7);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(first.next(), second.next());
  first.reset();
  EXPECT_LE(first.next(), 200ms);
  EXPECT_LE(first.next(), 400ms);
  Backoff third(8);
  EXPECT_NE(Backoff(7).next(), third.next());
}

TEST(Backoff, KeepsToOtherBounds) {
  Backoff backoff(1, {10ms, 10ms});
  for (int i = 0; i < 100; ++i) EXPECT_EQ(backoff.next(), 10ms);
}

}  // namespace
}  // namespace osteon
