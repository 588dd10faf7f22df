#include "common/link/replay_window.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>
#include <vector>

namespace osteon {
namespace {

constexpr std::uint64_t kLast = std::numeric_limits<std::uint64_t>::max();

// The correct answer of a window, from everything that was ever marked.
struct Oracle {
  std::set<std::uint64_t> marked;
  [[nodiscard]] bool is_newest(std::uint64_t counter) const { return marked.empty() || counter > *marked.rbegin(); }
  [[nodiscard]] bool is_fresh(std::uint64_t counter) const {
    return is_newest(counter) || (*marked.rbegin() - counter < ReplayWindow::kSpan && !marked.contains(counter));
  }
};

// Compares the window with the oracle while marking. Returns the number of fresh counters.
int agree(const std::vector<std::uint64_t>& counters) {
  ReplayWindow window;
  Oracle oracle;
  int fresh = 0;
  for (const std::uint64_t counter : counters) {
    EXPECT_EQ(window.is_newest(counter), oracle.is_newest(counter)) << counter;
    const bool is_fresh = window.is_fresh(counter);
    EXPECT_EQ(is_fresh, oracle.is_fresh(counter)) << counter;
    if (testing::Test::HasFailure()) return fresh;
    if (!is_fresh) continue;
    window.mark(counter);
    oracle.marked.insert(counter);
    EXPECT_FALSE(window.is_fresh(counter)) << counter;
    ++fresh;
  }
  return fresh;
}

TEST(ReplayWindow, TakesEachCounterOnceInAnyOrder) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    std::mt19937_64 random(seed);
    std::vector<std::uint64_t> counters;
    for (std::uint64_t i = 0; i < 2 * ReplayWindow::kSpan; ++i) counters.push_back(i);
    // Shuffled within stretches shorter than the window, and each sent twice: every counter is taken exactly once.
    for (std::size_t at = 0; at < counters.size(); at += 1024)
      std::shuffle(counters.begin() + static_cast<long>(at), counters.begin() + static_cast<long>(at + 1024), random);
    std::vector<std::uint64_t> twice;
    for (const std::uint64_t counter : counters)
      twice.insert(twice.end(), {counter, counters[random() % counters.size()], counter});
    SCOPED_TRACE(seed);
    agree(twice);
    EXPECT_EQ(agree(counters), static_cast<int>(counters.size()));
  }
}

TEST(ReplayWindow, AgreesWithASetOfAllThatWasSeen) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    // The front moves in small steps, and sometimes by about a window, its ring, or far more.
    std::uint64_t front = seed % 3 == 0 ? 0 : seed % 3 == 1 ? random() >> 1 : kLast - 40000;
    std::vector<std::uint64_t> counters;
    for (int i = 0; i < 3000; ++i) {
      const std::uint64_t jumps[] = {
          0, 1, random() % 70, random() % 70, 2040 + random() % 150, 2112, random() % 100000};
      const bool far = random() % 100 == 0;
      const std::uint64_t jump = jumps[far ? 4 + random() % 3 : random() % 4];
      front += std::min(jump, kLast - front);
      // The earlier contents of the ring must not be taken for those at the window's far end.
      for (std::uint64_t back = 1980; far && back < 2060; back += 3)
        counters.insert(counters.end(), {front, front - std::min(back, front)});
      const std::uint64_t back = random() % 20 == 0 ? 1900 + random() % 300 : random() % 100;
      counters.push_back(front - std::min(back, front));
      counters.push_back(front);
    }
    agree(counters);
  }
}

TEST(ReplayWindow, ReachesTheLastCounter) {
  ReplayWindow window;
  window.mark(kLast);
  EXPECT_FALSE(window.is_fresh(kLast));
  EXPECT_TRUE(window.is_fresh(kLast - ReplayWindow::kSpan + 1));
  EXPECT_FALSE(window.is_fresh(kLast - ReplayWindow::kSpan));
  EXPECT_FALSE(window.is_fresh(0));
}

TEST(ReplayWindowDeathTest, IsNotMarkedTwice) {
  ReplayWindow window;
  window.mark(7);
  EXPECT_DEATH(window.mark(7), "is_fresh");
}

}  // namespace
}  // namespace osteon
