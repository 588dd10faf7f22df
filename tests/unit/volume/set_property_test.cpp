// A bone is a function of the set of its cuts: order and repetition do not change its hash.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/random_cuts.hpp"

namespace osteon::test {
namespace {

Digest name_after(const Case& bone, const std::vector<Cut>& cuts, const std::vector<std::size_t>& order) {
  CutField field(bone, BodyId{});
  for (const std::size_t i : order) field.apply(cuts[i]);
  return field.hash();
}

TEST(SetProperty, EveryOrderWithRepeatsGivesOneName) {
  constexpr std::size_t kCuts = 120;
  constexpr int kOrders = 6, kThreads = 2;
  const Case bone = ball_of_bone();
  Random random(5);
  const std::vector<Cut> cuts = grazing_cuts(kCuts, random);
  const Digest expected = name_after(bone, cuts, order_with_repeats(kCuts, 0, random));
  EXPECT_NE(expected, name_after(bone, cuts, {}));

  std::atomic<int> next{0}, differing{0};
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t)
      threads.emplace_back([&] {
        for (int i = next++; i < kOrders; i = next++) {
          Random own(100 + static_cast<std::uint64_t>(i));
          if (name_after(bone, cuts, order_with_repeats(kCuts, 12, own)) != expected) ++differing;
        }
      });
  }
  EXPECT_EQ(differing, 0);
}

TEST(SetProperty, EveryCutMatters) {
  // Otherwise the test above could pass with cuts that do nothing.
  constexpr std::size_t kCuts = 40;
  const Case bone = ball_of_bone();
  Random random(6);
  const std::vector<Cut> cuts = grazing_cuts(kCuts, random);
  std::vector<std::size_t> all(kCuts);
  for (std::size_t i = 0; i < kCuts; ++i) all[i] = i;
  const Digest whole = name_after(bone, cuts, all);
  int matter = 0;
  for (std::size_t i = 0; i < kCuts; i += 4) {
    std::vector<std::size_t> without = all;
    without.erase(without.begin() + static_cast<std::ptrdiff_t>(i));
    matter += name_after(bone, cuts, without) != whole ? 1 : 0;
  }
  EXPECT_GE(matter, 8);
}

}  // namespace
}  // namespace osteon::test
