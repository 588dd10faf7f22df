// Tests a room over a bad network, with real processes and sockets.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/integration/bad_network.hpp"

namespace osteon::test {
namespace {

void expect_converged(const BadNetworkRun& run) {
  EXPECT_EQ(run.fault, "");
  EXPECT_GT(run.sent, 20u);
  EXPECT_EQ(run.kept, run.sent) << "every cut is decided";
  std::vector<double> felt_ms = run.felt_ms;
  std::ranges::sort(felt_ms);
  const auto percentile = [&](std::size_t percent) {
    return felt_ms.empty() ? 0.0 : felt_ms[percent * (felt_ms.size() - 1) / 100];
  };
  std::printf("%llu cuts, one bone after %.2f s, felt by the other after %.0f ms (99 of 100: %.0f ms)\n",
              static_cast<unsigned long long>(run.sent), run.converged_s, percentile(50), percentile(99));
}

TEST(BadNetwork, HandsConvergeWhateverItDoes) {
  const BadNetwork bad{.impairment = {"delay 40 10", "loss 0.3", "reorder 0.1", "duplicate 0.05"}};
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const BadNetworkRun run = run_on(bad, seed);
    expect_converged(run);
    EXPECT_TRUE(run.fast_path_alive);
  }
}

TEST(BadNetwork, HandsConvergeAfterPartitionsResetsAndAMove) {
  expect_converged(run_on({.impairment = {"delay 20 5", "loss 0.1"},
                           .work = std::chrono::milliseconds(3000),
                           .meanwhile = {"partition 700", "reset", "rebind"}},
                          3));
}

TEST(BadNetwork, WithoutDatagramsTheStreamsCarryAll) {
  const BadNetworkRun run = run_on({.impairment = {"delay 20 5"}, .fast_path = "off"}, 4);
  expect_converged(run);
  EXPECT_FALSE(run.fast_path_alive);
}

}  // namespace
}  // namespace osteon::test
