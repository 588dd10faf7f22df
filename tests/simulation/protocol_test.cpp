// Many small rooms: what matters is who said what when, not how much bone there is.
#include "tests/simulation/seeds.hpp"

namespace osteon {
namespace {

using namespace test;

TEST(Simulation, KeepsItsPromisesWhateverHappens) {
  SimulationReport sum;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const SimulationReport one = simulate_quietly(seed);
    expect_no_faults(one, "");
    sum.committed += one.committed, sum.rejected += one.rejected, sum.undone += one.undone, sum.crashes += one.crashes;
    sum.disk_failures += one.disk_failures, sum.breaks += one.breaks, sum.resumed += one.resumed;
  }
  // The trouble was there.
  EXPECT_GT(sum.committed, 5000u);
  EXPECT_GT(sum.rejected, 300u);
  EXPECT_GT(sum.undone, 100u);
  EXPECT_GT(sum.crashes, 300u);
  EXPECT_GT(sum.disk_failures, 10u);
  EXPECT_GT(sum.breaks, 300u);
  EXPECT_GT(sum.resumed, 300u);
}

TEST(Simulation, IsTheSameForTheSameSeed) {
  for (const std::uint64_t seed : {1u, 7u}) {
    const SimulationReport one = simulate_quietly(seed), again = simulate_quietly(seed);
    EXPECT_EQ(one.rows, again.rows);
    EXPECT_EQ(one.cuts, again.cuts);
    EXPECT_EQ(one.acknowledged, again.acknowledged);
    EXPECT_EQ(one.virtual_s, again.virtual_s);
    EXPECT_EQ(one.resumed, again.resumed);
  }
}

// What is broken on purpose is found.
TEST(Simulation, FindsRowsInAnotherOrder) { EXPECT_GT(found(Breakage::ordering, 40), 0u); }
TEST(Simulation, FindsRowsThatAreLeftOut) { EXPECT_GT(found(Breakage::skipping, 40), 0u); }
TEST(Simulation, FindsCutsThatAreTakenTwice) { EXPECT_GT(found(Breakage::dedup, 40), 0u); }
TEST(Simulation, FindsAReplicaThatDoesNotComeBackRight) { EXPECT_GT(found(Breakage::replica, 40), 0u); }
TEST(Simulation, FindsAJournalThatWaitsForNoDisk) { EXPECT_GT(found(Breakage::forgetful, 40), 0u); }

}  // namespace
}  // namespace osteon
