// Verifying, backing up, salvaging and migrating journals as files.
#include "server/journal/maintenance.hpp"

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "tests/support/disk/journal_trials.hpp"
#include "tests/support/disk/memory_disk.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/journal/entries.hpp"
#include "tests/unit/journal/old_journals.hpp"

namespace osteon {
namespace {

using test::MemoryDisk;
using test::plain_head;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* kTo = "/backup/journal";

class JournalMaintenanceTest : public ::testing::Test {
 protected:
  // A journal with every kind of content.
  void make(bool closed) {
    Journal journal = std::move(Journal::create(kFile, "bone", {.disk = &disk_}).value());
    for (std::size_t i = 0; i < entries_.size(); i += 5) append(journal, entries_, i, i + 5);
    ASSERT_TRUE(journal.set_person({"p1", "Anna", 20000}));
    ASSERT_TRUE(journal.set_register("retention_days", "30"));
    ASSERT_TRUE(journal.next_server_epoch());
    for (const std::size_t seq : {10, 25}) {
      const JournalHead at =
          plain_head("bone", {entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(seq)});
      auto file = journal.begin_checkpoint(at, "meta");
      ASSERT_TRUE(file && file->write("room at " + std::to_string(seq)) && file->finish());
      ASSERT_TRUE(journal.add_checkpoint(std::move(*file)));
    }
    if (closed) {
      ASSERT_TRUE(journal.close());
    }
  }
  Journal open(const char* file) { return std::move(Journal::open(file, {.disk = &disk_}).value()); }
  void expect_copied(Journal& journal) {
    EXPECT_EQ(journal.closed_because(), nullptr);
    EXPECT_EQ(journal.head(), plain_head("bone", entries_));
    EXPECT_TRUE(equal(entries_of(journal), entries_));
    EXPECT_THAT(journal.people().value(), ElementsAre(Person{"p1", "Anna", 20000}));
    EXPECT_EQ(journal.find_register("retention_days").value(), "30");
    const auto checkpoints = journal.checkpoints().value();
    ASSERT_THAT(checkpoints, SizeIs(2));
    EXPECT_EQ(journal.read_checkpoint(checkpoints[0]).value(), "room at 25");
    EXPECT_EQ(journal.read_checkpoint(checkpoints[1]).value(), "room at 10");
  }
  MemoryDisk disk_{1};
  std::vector<JournalEntry> entries_ = some_entries(10, 40);
};

TEST_F(JournalMaintenanceTest, ASoundJournalIsFoundSoundAndIsLeftAsItWas) {
  for (const bool closed : {true, false}) {
    disk_.load({});
    make(closed);
    const MemoryDisk::Image before = disk_.image();
    const auto report = verify_journal(kFile, &disk_);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_THAT(report->faults, IsEmpty());
    EXPECT_EQ(report->version, 4);
    EXPECT_EQ(report->head, plain_head("bone", entries_));
    EXPECT_EQ(report->witnessed, RoomSeq{40});
    EXPECT_EQ(report->closed_cleanly, closed);
    EXPECT_EQ(disk_.image(), before);
  }
}

TEST_F(JournalMaintenanceTest, TheFirstBadEntryIsNamed) {
  make(true);
  const std::string bytes = disk_.image().at(kFile);
  const std::size_t at = bytes.find(entries_[17].bytes);
  ASSERT_NE(at, std::string::npos);
  disk_.flip_bit(kFile, 8 * at + 3);
  const auto report = verify_journal(kFile, &disk_);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->first_bad, RoomSeq{18});
  EXPECT_THAT(report->faults.front(), HasSubstr("entry 18 does not fit the chain of hashes"));
  EXPECT_EQ(report->head, plain_head("bone", {entries_.begin(), entries_.begin() + 17}));

  const MemoryDisk::Image before = disk_.image();
  EXPECT_EQ(backup_journal(kFile, kTo, &disk_).error().code, ErrorCode::invalid_input);
  const auto recovered = salvage_journal(kFile, kTo, &disk_);
  ASSERT_TRUE(recovered) << recovered.error().message;
  EXPECT_EQ(recovered->head.seq, RoomSeq{17});
  EXPECT_EQ(recovered->lost(), 23u) << "of the 40 entries that the footer confirms";
  for (const auto& [name, content] : before) EXPECT_EQ(disk_.image().at(name), content) << name;
  Journal journal = open(kTo);
  EXPECT_EQ(journal.closed_because(), nullptr);
  EXPECT_TRUE(equal(entries_of(journal), {entries_.begin(), entries_.begin() + 17}));
  EXPECT_THAT(journal.people().value(), ElementsAre(Person{"p1", "Anna", 20000}));
  const auto checkpoints = journal.checkpoints().value();
  ASSERT_THAT(checkpoints, SizeIs(1)) << "the checkpoint behind the damage is not of this history";
  EXPECT_EQ(journal.read_checkpoint(checkpoints[0]).value(), "room at 10");
  EXPECT_GT(journal.next_server_epoch().value(), 1000u) << "far from the numbers that the lost part may have used";
  append(journal, entries_, 17, 20);
}

TEST_F(JournalMaintenanceTest, ASpoiledCheckpointIsFoundAndLeftBehind) {
  make(true);
  const std::string newest = checkpoint_path(disk_, {RoomSeq{25}, {}});
  disk_.flip_bit(newest, 0);
  const auto report = verify_journal(kFile, &disk_);
  ASSERT_TRUE(report);
  ASSERT_THAT(report->faults, SizeIs(1));
  EXPECT_THAT(report->faults.front(), HasSubstr(newest + " is not what was written"));
  EXPECT_EQ(report->first_bad, std::nullopt);
  EXPECT_FALSE(backup_journal(kFile, kTo, &disk_));
  const auto recovered = salvage_journal(kFile, kTo, &disk_);
  ASSERT_TRUE(recovered);
  EXPECT_EQ(recovered->lost(), 0u);
  Journal journal = open(kTo);
  EXPECT_THAT(journal.checkpoints().value(), SizeIs(1));
  EXPECT_TRUE(equal(entries_of(journal), entries_));
}

TEST_F(JournalMaintenanceTest, ABackupIsTheJournalAgain) {
  for (const bool closed : {true, false}) {
    disk_.load({});
    make(closed);
    const MemoryDisk::Image before = disk_.image();
    const Result<void> done = backup_journal(kFile, kTo, &disk_);
    ASSERT_TRUE(done) << done.error().message;
    const MemoryDisk::Image after = disk_.image();
    for (const auto& [name, content] : before) EXPECT_EQ(after.at(name), content) << name;
    EXPECT_THAT(after, SizeIs(before.size() + 3)) << "only the copy and its two checkpoints are new";
    Journal copy = open(kTo);
    expect_copied(copy);
    EXPECT_EQ(copy.next_server_epoch().value(), 2u);
    EXPECT_FALSE(copy.recovered_to());
    EXPECT_EQ(backup_journal(kFile, kTo, &disk_).error().code, ErrorCode::exists);
  }
}

TEST_F(JournalMaintenanceTest, ABackupInSlicesLetsEntriesBeAppendedBetween) {
  make(false);
  Journal journal = open(kFile);
  auto copy = JournalCopy::begin(journal, kTo);
  ASSERT_TRUE(copy) << copy.error().message;
  const std::vector<JournalEntry> all = some_entries(10, 60);
  std::size_t steps = 0, next = 40;
  for (Result<bool> done = false;; ++steps) {
    done = copy->step(7);
    ASSERT_TRUE(done) << done.error().message;
    if (*done) break;
    append(journal, all, next, next + 1);
    ++next;
  }
  EXPECT_EQ(steps, 7u) << "40 entries in slices of 7, then two checkpoints";
  EXPECT_EQ(journal.head(), plain_head("bone", {all.begin(), all.begin() + 47}));
  Journal backup = open(kTo);
  expect_copied(backup);
}

TEST_F(JournalMaintenanceTest, ACopyThatIsGivenUpOrCutShortLeavesNothingInTheWay) {
  make(false);
  {
    Journal journal = open(kFile);
    const MemoryDisk::Image before = disk_.image();
    auto copy = JournalCopy::begin(journal, kTo);
    ASSERT_TRUE(copy && copy->step(7));
  }
  for (const auto& [name, bytes] : disk_.image()) EXPECT_FALSE(name.starts_with("/backup/")) << name;
  for (std::uint64_t n = 1; n < 150; n += 3) {
    disk_.fail_power_at(n);
    const bool done = backup_journal(kFile, kTo, &disk_).has_value();
    EXPECT_EQ(done, !disk_.has_failed());
    disk_.power_returns();
    if (disk_.size(kTo).value()) {  // everything but the sync of the last step may be done
      Journal copy = open(kTo);
      expect_copied(copy);
    } else {
      const Result<void> again = backup_journal(kFile, kTo, &disk_);
      // Checkpoints that already had their names prevent a new copy, and the error says so.
      EXPECT_TRUE(again || again.error().code == ErrorCode::exists) << again.error().message;
    }
    Journal source = open(kFile);
    EXPECT_EQ(source.closed_because(), nullptr);
    ASSERT_TRUE(equal(entries_of(source), entries_));
    MemoryDisk::Image kept = disk_.image();
    std::erase_if(kept, [](const auto& file) { return file.first.starts_with("/backup/"); });
    { const Journal dropped = std::move(source); }
    disk_.load(kept);
  }
}

TEST_F(JournalMaintenanceTest, WhatClientsKnowCountsAsLost) {
  make(true);
  const auto recovered = salvage_journal(kFile, kTo, &disk_, {{RoomSeq{39}, {}}, {RoomSeq{44}, {}}});
  ASSERT_TRUE(recovered);
  EXPECT_EQ(recovered->lost(), 4u);
}

// After a salvage, a client that knows more has lost it. One that knows another history of the entries that are there
// has a different bone, salvaged or not.
TEST_F(JournalMaintenanceTest, ASalvagedJournalRefusesAnotherHistory) {
  make(true);
  ASSERT_TRUE(salvage_journal(kFile, kTo, &disk_));
  Journal journal = open(kTo);
  ASSERT_TRUE(journal.recovered_to());
  EXPECT_TRUE(journal.check_witness(plain_head("bone", {entries_.begin(), entries_.begin() + 3})));
  const Result<void> other = journal.check_witness(plain_head("other bone", {entries_.begin(), entries_.begin() + 3}));
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(other.error().message, HasSubstr("different histories up to event 3"));
}

TEST(Migration, TakesAFirstVersionIntoACopyWithTheSameChain) {
  const test::TempDir folder;
  const std::filesystem::path old = folder / "old", now = folder / "new";
  std::vector<JournalEntry> entries = some_entries(11, 30);
  for (JournalEntry& entry : entries) entry.at_ns = 0;  // Version 1 stored no times.
  ASSERT_NO_FATAL_FAILURE(make_old_journal(old, 1, entries, RowsIn::file));

  const auto opened = Journal::open(old);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
  EXPECT_THAT(opened.error().message, HasSubstr("is a journal of version 1; migrate it"));
  const auto verified = verify_journal(old);
  ASSERT_TRUE(verified) << verified.error().message;
  EXPECT_TRUE(verified->sound());
  EXPECT_EQ(verified->version, 1);

  const Result<void> migrated = migrate_journal(old, now);
  ASSERT_TRUE(migrated) << migrated.error().message;
  EXPECT_EQ(verify_journal(old)->version, 1) << "the old journal is unchanged";
  EXPECT_EQ(verify_journal(now)->version, 4);
  Journal journal = std::move(Journal::open(now).value());
  EXPECT_EQ(journal.closed_because(), nullptr);
  EXPECT_TRUE(equal(entries_of(journal), entries));
  EXPECT_TRUE(journal.check_witness(plain_head("bone", entries)))
      << "what clients have acknowledged is still confirmed";
  const JournalEntry next{RoomSeq{31}, 12345, "next"};
  EXPECT_TRUE(journal.append({&next, 1}));
  ASSERT_TRUE(journal.close());
  EXPECT_EQ(migrate_journal(now, folder / "newer").error().code, ErrorCode::exists);
}

// Changes a journal as another program would.
void change(const std::filesystem::path& file, const char* sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK);
  ASSERT_EQ(sqlite3_close(database), SQLITE_OK);
}

TEST(Migration, RefusesAVersionOfTheFuture) {
  const test::TempDir folder;
  { ASSERT_TRUE(Journal::create(folder / "journal", "bone")->close()); }
  change(folder / "journal", "PRAGMA user_version=5");
  const auto opened = Journal::open(folder / "journal");
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
  EXPECT_THAT(opened.error().message, HasSubstr("of version 5, this program reads up to version 4"));
}

TEST(Migration, RefusesTablesThatAreNotThoseOfTheVersion) {
  const test::TempDir folder;
  { ASSERT_TRUE(Journal::create(folder / "journal", "bone")->close()); }
  change(folder / "journal",
         "CREATE TRIGGER t AFTER INSERT ON rows BEGIN DELETE FROM rows WHERE place = new.place; END");
  const auto opened = Journal::open(folder / "journal");
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(opened.error().message, HasSubstr("the definition of its tables of version 4 is damaged"));
}

}  // namespace
}  // namespace osteon
