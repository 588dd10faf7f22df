// Many small rooms. The order of messages matters here, not the amount of bone.
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "tests/simulation/ledger.hpp"
#include "tests/simulation/seeds.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/trials.hpp"

namespace osteon {
namespace {

using namespace test;

TEST(Simulation, KeepsItsPromisesWhateverHappens) {
  SimulationReport sum;
  std::uint64_t fast_path = 0;
  for (std::uint64_t seed = 1; seed <= trials(300); ++seed) {
    const SimulationReport one = simulate_quietly(seed);
    expect_no_faults(one, "");
    sum.committed += one.committed, sum.rejected += one.rejected, sum.undone += one.undone, sum.crashes += one.crashes;
    sum.decisions += one.decisions, sum.forbidden += one.forbidden;
    sum.denied += one.denied, sum.carried += one.carried;
    sum.disk_failures += one.disk_failures, sum.breaks += one.breaks, sum.resumed += one.resumed;
    fast_path += one.fast_path ? 1 : 0;
    sum.datagrams.opened += one.datagrams.opened, sum.datagrams.forged += one.datagrams.forged;
    sum.datagrams.cuts += one.datagrams.cuts, sum.datagrams.entries += one.datagrams.entries;
    sum.datagrams.moves += one.datagrams.moves;
  }
  // The planned faults did happen.
  EXPECT_GT(sum.committed, trials(4000));
  EXPECT_GT(sum.rejected, trials(300));
  EXPECT_GT(sum.undone, trials(100));
  EXPECT_GT(sum.decisions, trials(500));
  EXPECT_GT(sum.forbidden, trials(100));
  EXPECT_GT(sum.denied, trials(20, 2));  // so rare that a quarter of the seeds may have less than a quarter
  EXPECT_GT(sum.carried, trials(10));
  EXPECT_GT(sum.crashes, trials(300));
  EXPECT_GT(sum.disk_failures, trials(8));
  EXPECT_GT(sum.breaks, trials(300));
  EXPECT_GT(sum.resumed, trials(300));
  EXPECT_GT(fast_path, trials(100));
  EXPECT_LT(fast_path, trials(200));
  EXPECT_GT(sum.datagrams.opened, trials(20'000));
  EXPECT_GT(sum.datagrams.forged, trials(500));
  EXPECT_GT(sum.datagrams.cuts, trials(500));
  EXPECT_GT(sum.datagrams.entries, trials(300));
  EXPECT_GT(sum.datagrams.moves, trials(300));
}

TEST(Simulation, IsTheSameForTheSameSeed) {
  for (const std::uint64_t seed : {1u, 2u, 7u, 8u}) {
    const SimulationReport one = simulate_quietly(seed), again = simulate_quietly(seed);
    EXPECT_EQ(one.entries, again.entries);
    EXPECT_EQ(one.cuts, again.cuts);
    EXPECT_EQ(one.acknowledged, again.acknowledged);
    EXPECT_EQ(one.virtual_s, again.virtual_s);
    EXPECT_EQ(one.resumed, again.resumed);
    EXPECT_EQ(one.datagrams.sent, again.datagrams.sent);
    EXPECT_EQ(one.datagrams.opened, again.datagrams.opened);
  }
}

// Deliberate defects are found.
TEST(Simulation, FindsEntriesInAnotherOrder) { EXPECT_GT(found(Breakage::ordering, 40), 0u); }
TEST(Simulation, FindsEntriesThatAreLeftOut) { EXPECT_GT(found(Breakage::skipping, 40), 0u); }
TEST(Simulation, FindsCutsThatAreTakenTwice) { EXPECT_GT(found(Breakage::dedup, 40), 0u); }
TEST(Simulation, FindsAReplicaThatDoesNotComeBackRight) { EXPECT_GT(found(Breakage::replica, 40), 0u); }
TEST(Simulation, FindsAJournalThatWaitsForNoDisk) { EXPECT_GT(found(Breakage::forgetful, 40), 0u); }

TEST(Simulation, FindsASessionThatReceivesTooSoon) { EXPECT_GT(found(Breakage::hasty, 150), 0u); }

TEST(Simulation, FindsAHandThatReceivesNothing) { EXPECT_GT(found(Breakage::unsaid, 40), 0u); }

// Entries of a room that enforces nothing. The ledger must find the violations without a room's decisions.
struct Entries {
  Entries() {
    join(1, 7);
    join(2, 8);
  }
  void add(std::uint64_t by, decltype(LogEntry::what) what) {
    entries.push_back({RoomSeq{entries.size() + 1}, {}, AuthorId{by}, std::move(what)});
  }
  void join(std::uint64_t author, std::uint32_t person) {
    add(author, JoinEntry{.author = AuthorId{author}, .kind = MemberKind::surgeon, .person = person});
  }
  void hold(std::uint64_t subject, const Restrictions& word) { add(1, SuperviseEntry{AuthorId{subject}, word}); }
  void cut(std::uint64_t author, std::uint64_t lease = 1) {
    Cut one = straight_cut(find_tool("burr-round-3.2").value(), {1, 0, 0}, {2, 0, 0}, {0, 0, -1}, ++cuts[author]);
    one.author = AuthorId{author};
    one.lease_epoch = lease;
    ledger.made(one, {});
    add(author, CutEntry{one});
  }
  std::size_t supervised() {
    ledger.check_entries(entries);
    for (const Fault& fault : ledger.faults()) EXPECT_EQ(fault.invariant, Invariant::supervised) << fault.sentence;
    return ledger.faults().size();
  }

  Ledger ledger;
  std::vector<LogEntry> entries;
  std::map<std::uint64_t, std::uint64_t> cuts;
};

const Digest kBurr = find_tool("burr-round-3.2").value().hash(), kDrill = find_tool("drill-3.2").value().hash();

TEST(Ledger, FindsCutsThatWereForbidden) {
  const auto found = [](const Restrictions& word) {
    Entries all;
    all.hold(2, word);
    all.cut(2, word.may_cut() ? 1 : 4);
    return all.supervised();
  };
  const std::int32_t mm = static_cast<std::int32_t>(1.0 / kQuantum_mm);
  EXPECT_EQ(found({}), 0u);
  EXPECT_EQ(found({.stopped = true}), 1u);
  EXPECT_EQ(found({.taken_by = AuthorId{1}}), 1u);
  EXPECT_EQ(found({.tools = {kBurr}}), 0u);
  EXPECT_EQ(found({.tools = {kDrill}}), 1u);
  EXPECT_EQ(found({.zone = ZoneLimit{{mm, 0, 0}, mm}}), 0u) << "its end is on the edge";
  EXPECT_EQ(found({.zone = ZoneLimit{{mm, 0, 0}, mm - 1}}), 1u);
}

TEST(Ledger, FindsWhatAHeldHandTookBackOrDidAgain) {
  const auto found = [](std::uint64_t by, const Restrictions& word, bool again) {
    Entries all;
    all.cut(2);
    if (again) all.add(1, UndoEntry{{RoomSeq{3}}});
    all.hold(2, word);
    if (again)
      all.add(by, RedoEntry{{RoomSeq{4}}, {RoomSeq{3}}});
    else
      all.add(by, UndoEntry{{RoomSeq{3}}});
    return all.supervised();
  };
  EXPECT_EQ(found(2, {}, true), 0u);
  EXPECT_EQ(found(2, {.stopped = true}, false), 1u);
  EXPECT_EQ(found(2, {.taken_by = AuthorId{1}}, false), 1u);
  EXPECT_EQ(found(1, {.stopped = true}, false), 0u) << "another's word is no matter of this one";
  EXPECT_EQ(found(2, {.stopped = true}, true), 2u) << "that it did anything, and the cut";
  EXPECT_EQ(found(2, {.tools = {kDrill}}, true), 1u);
  EXPECT_EQ(found(2, {.zone = ZoneLimit{{0, 0, 0}, 1}}, true), 1u);
  EXPECT_EQ(found(2, {.tools = {kDrill}}, false), 0u);
}

TEST(Ledger, FindsAHandThatIsLetGoByComingAgain) {
  const auto found = [](std::uint32_t person, std::optional<Restrictions> carried) {
    Entries all;
    all.hold(2, {.stopped = true});
    all.join(3, person);
    if (carried) all.hold(3, *carried);
    return all.supervised();
  };
  EXPECT_EQ(found(8, {}), 1u);
  EXPECT_EQ(found(8, Restrictions{.stopped = true}), 0u);
  EXPECT_EQ(found(8, Restrictions{.force_limit = 1}), 1u);
  EXPECT_EQ(found(7, {}), 0u) << "whose hand is free";
  EXPECT_EQ(found(0, {}), 0u) << "nobody knows who that is";
}

TEST(Simulation, FindsEntriesThatDatagramsLose) { EXPECT_GT(found(Breakage::pruning, 150), 0u); }

}  // namespace
}  // namespace osteon
