// Hundreds of trials, every night thousands, of the journal on disks that lose power and that fail.
#include <gtest/gtest.h>

#include <cerrno>
#include <cstdio>

#include "tests/support/disk/damage_trials.hpp"
#include "tests/support/disk/journal_trials.hpp"
#include "tests/support/trials.hpp"

namespace osteon::test {
namespace {

void show(const char* what, const Tally& tally) {
  std::printf("%s: %lu trials, %lu entries acknowledged, %lu recovered, of them %lu not acknowledged, %lu lost, ", what,
              tally.trials, tally.acknowledged, tally.recovered, tally.kept_unasked, tally.lost);
  std::printf("%lu closed to entries, %lu bad trials\n", tally.closed, tally.bad_trials);
}

void expect_nothing_lost(const Tally& tally) {
  for (const std::string& fault : tally.faults) ADD_FAILURE() << fault;
  EXPECT_EQ(tally.lost, 0u);
  EXPECT_EQ(tally.bad_trials, 0u);
}

TEST(JournalTrials, LosesNothingAcknowledgedWhenThePowerFails) {
  const Tally tally = power_loss_trials(1, trials(2000));
  show("power loss", tally);
  expect_nothing_lost(tally);
  EXPECT_EQ(tally.closed, 0u) << "a power failure alone is no reason to refuse entries";
  // The trials are hard: the disk fails in most of them, and often while a batch is under way.
  EXPECT_GT(tally.failed, tally.trials * 9 / 10);
  EXPECT_GT(tally.acknowledged, 10 * tally.trials);
  EXPECT_GT(tally.kept_unasked, trials(100));
}

// The same trials must find the loss when entries are acknowledged before the disk has them.
TEST(JournalTrials, FindsEntriesLostWhenNobodyWaitsForTheDisk) {
  const Tally tally = power_loss_trials(1, 100, false);
  show("power loss, synchronous=OFF", tally);
  EXPECT_GT(tally.bad_trials, 90u);
  EXPECT_GT(tally.lost, 100u);
}

TEST(JournalTrials, LosesNothingAcknowledgedWhenAnyWriteOrSyncFails) {
  const Tally tally = failing_disk_trials(10000, trials(1000), EIO);
  show("EIO", tally);
  expect_nothing_lost(tally);
  EXPECT_EQ(tally.failed, trials(1000));
  EXPECT_GT(tally.closed, trials(240));
}

TEST(JournalTrials, LosesNothingAcknowledgedWhenTheDiskIsFullAtAnyWrite) {
  const Tally tally = failing_disk_trials(20000, trials(1000), ENOSPC);
  show("ENOSPC", tally);
  expect_nothing_lost(tally);
  EXPECT_EQ(tally.failed, trials(1000));
  EXPECT_GT(tally.closed, trials(240));
}

// Data that looks written after a failed sync is not. The next process must write it again before it appends.
TEST(JournalTrials, LosesNothingAcknowledgedWhereAFailedSyncWasForgotten) {
  const Tally tally = forgotten_sync_trials(1, trials(1000));
  show("forgotten sync", tally);
  expect_nothing_lost(tally);
  EXPECT_EQ(tally.failed, trials(1000));
  EXPECT_EQ(tally.closed, 0u);
}

void show(const char* what, const DamageTally& tally) {
  std::printf("%s: %lu trials, %lu entries acknowledged; %lu whole, %lu damage named, %lu refused, %lu silent, ", what,
              tally.trials, tally.acknowledged, tally.whole, tally.named, tally.refused, tally.silent);
  std::printf("%lu called damaged\n", tally.called_damaged);
  for (const std::string& fault : tally.faults) std::printf("  %s\n", fault.c_str());
}

TEST(JournalTrials, DamageToAnyOneFileIsHarmlessOrNamed) {
  const DamageTally tally = damage_trials(1, trials(2000));
  show("damage", tally);
  EXPECT_EQ(tally.silent, 0u) << tally.faults.front();
  EXPECT_GT(tally.whole, tally.trials / 4);
  EXPECT_GT(tally.named, tally.trials / 20);
  EXPECT_GT(tally.refused, tally.trials / 20);
}

// The same trials must find the loss when there is only one log.
TEST(JournalTrials, DamageToTheOnlyLogIsSilent) {
  const DamageTally tally = damage_trials(1, 300, DamagedFiles::only_log_left);
  show("damage, without a mirror", tally);
  EXPECT_GT(tally.silent, 0u);
}

TEST(JournalTrials, NobodyCallsAKilledJournalDamaged) {
  for (const bool power_fails : {false, true}) {
    const DamageTally tally = kill_trials(30000, trials(1000), power_fails);
    show(power_fails ? "power failures" : "kills", tally);
    EXPECT_EQ(tally.called_damaged, 0u);
    EXPECT_EQ(tally.silent, 0u);
    EXPECT_GT(tally.acknowledged, tally.trials);
  }
}

}  // namespace
}  // namespace osteon::test
