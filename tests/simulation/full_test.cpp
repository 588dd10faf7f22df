// Larger rooms in the worst networks: drills, pieces that separate, undo under load.
#include "tests/simulation/seeds.hpp"

namespace osteon {
namespace {

using namespace test;

TEST(FullSimulation, KeepsItsPromisesWhateverHappens) {
  SimulationReport sum;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const SimulationReport one = simulate_quietly(seed, {.full = true});
    expect_no_faults(one, " --full");
    sum.committed += one.committed, sum.undone += one.undone, sum.splits += one.splits, sum.crashes += one.crashes;
  }
  EXPECT_GT(sum.committed, 500u);
  EXPECT_GT(sum.undone, 5u);
  EXPECT_GT(sum.splits, 3u);
  EXPECT_GT(sum.crashes, 5u);
}

}  // namespace
}  // namespace osteon
