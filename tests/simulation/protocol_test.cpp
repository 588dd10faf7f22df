// Many small rooms: what matters is who said what when, not how much bone there is.
#include "tests/simulation/seeds.hpp"

namespace osteon {
namespace {

using namespace test;

TEST(Simulation, KeepsItsPromisesWhateverHappens) {
  SimulationReport sum;
  std::uint64_t fast_path = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const SimulationReport one = simulate_quietly(seed);
    expect_no_faults(one, "");
    sum.committed += one.committed, sum.rejected += one.rejected, sum.undone += one.undone, sum.crashes += one.crashes;
    sum.decisions += one.decisions, sum.forbidden += one.forbidden;
    sum.disk_failures += one.disk_failures, sum.breaks += one.breaks, sum.resumed += one.resumed;
    fast_path += one.fast_path ? 1 : 0;
    sum.datagrams.opened += one.datagrams.opened, sum.datagrams.forged += one.datagrams.forged;
    sum.datagrams.cuts += one.datagrams.cuts, sum.datagrams.rows += one.datagrams.rows;
    sum.datagrams.moves += one.datagrams.moves;
  }
  // The trouble was there.
  EXPECT_GT(sum.committed, 5000u);
  EXPECT_GT(sum.rejected, 300u);
  EXPECT_GT(sum.undone, 100u);
  EXPECT_GT(sum.decisions, 500u);
  EXPECT_GT(sum.forbidden, 100u);
  EXPECT_GT(sum.crashes, 300u);
  EXPECT_GT(sum.disk_failures, 10u);
  EXPECT_GT(sum.breaks, 300u);
  EXPECT_GT(sum.resumed, 300u);
  EXPECT_GT(fast_path, 100u);
  EXPECT_LT(fast_path, 200u);
  EXPECT_GT(sum.datagrams.opened, 20'000u);
  EXPECT_GT(sum.datagrams.forged, 500u);
  EXPECT_GT(sum.datagrams.cuts, 500u);
  EXPECT_GT(sum.datagrams.rows, 300u);
  EXPECT_GT(sum.datagrams.moves, 300u);
}

TEST(Simulation, IsTheSameForTheSameSeed) {
  for (const std::uint64_t seed : {1u, 2u, 7u, 8u}) {
    const SimulationReport one = simulate_quietly(seed), again = simulate_quietly(seed);
    EXPECT_EQ(one.rows, again.rows);
    EXPECT_EQ(one.cuts, again.cuts);
    EXPECT_EQ(one.acknowledged, again.acknowledged);
    EXPECT_EQ(one.virtual_s, again.virtual_s);
    EXPECT_EQ(one.resumed, again.resumed);
    EXPECT_EQ(one.datagrams.sent, again.datagrams.sent);
    EXPECT_EQ(one.datagrams.opened, again.datagrams.opened);
  }
}

// What is broken on purpose is found.
TEST(Simulation, FindsRowsInAnotherOrder) { EXPECT_GT(found(Breakage::ordering, 40), 0u); }
TEST(Simulation, FindsRowsThatAreLeftOut) { EXPECT_GT(found(Breakage::skipping, 40), 0u); }
TEST(Simulation, FindsCutsThatAreTakenTwice) { EXPECT_GT(found(Breakage::dedup, 40), 0u); }
TEST(Simulation, FindsAReplicaThatDoesNotComeBackRight) { EXPECT_GT(found(Breakage::replica, 40), 0u); }
TEST(Simulation, FindsAJournalThatWaitsForNoDisk) { EXPECT_GT(found(Breakage::forgetful, 40), 0u); }

TEST(Simulation, FindsAHandThatIsNotTold) { EXPECT_GT(found(Breakage::unsaid, 40), 0u); }

TEST(Simulation, FindsRowsThatDatagramsLose) { EXPECT_GT(found(Breakage::pruning, 150), 0u); }

}  // namespace
}  // namespace osteon
