// The newest entries of a journal: damage to their files, and to the journal while it is open.
#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "server/journal/maintenance.hpp"
#include "server/journal/mirrored_log.hpp"
#include "tests/support/disk/journal_trials.hpp"
#include "tests/support/disk/memory_disk.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/journal/entries.hpp"
#include "tests/unit/journal/old_journals.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

using test::MemoryDisk;
using test::plain_head;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char *kLog = "/room/journal-log", *kMirror = "/room/journal-mirror";

class LogTest : public ::testing::Test {
 protected:
  JournalOptions options() { return {.disk = &disk_, .log_bytes = 32 << 10}; }
  // A journal whose process was killed: some entries are in the database, the others in its log.
  void make_killed() {
    Journal journal = std::move(Journal::create(kFile, "bone", options()).value());
    append(journal, entries_, 0, 40);
    ASSERT_TRUE(journal.next_server_epoch());
    before_ = disk_.image();
    for (std::size_t i = 40; i < entries_.size(); i += 2) append(journal, entries_, i, i + 2);
  }
  // Opens it and expects all entries. Returns what was repaired.
  std::vector<std::string> expect_whole() {
    const auto report = verify_journal(kFile, &disk_);
    EXPECT_TRUE(report && report->sound()) << (report ? report->faults.front() : report.error().message);
    Journal journal = std::move(Journal::open(kFile, options()).value());
    EXPECT_EQ(journal.closed_because(), nullptr) << journal.closed_because()->message;
    EXPECT_TRUE(equal(entries_of(journal), entries_));
    EXPECT_EQ(report->notes, journal.notes());
    return journal.notes();
  }
  // Opens it and expects that it takes no entries. Returns the reason.
  std::string expect_closed(std::size_t entries) {
    const auto report = verify_journal(kFile, &disk_);
    EXPECT_TRUE(report && !report->sound());
    EXPECT_EQ(backup_journal(kFile, "/backup/journal", &disk_).error().code, ErrorCode::invalid_input);
    Journal journal = std::move(Journal::open(kFile, options()).value());
    EXPECT_NE(journal.closed_because(), nullptr) << "the journal takes entries";
    if (journal.closed_because() == nullptr) return {};
    EXPECT_FALSE(journal.next_server_epoch()) << "an epoch could be given twice";
    EXPECT_TRUE(
        equal(entries_of(journal), {entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(entries)}));
    return journal.closed_because()->message;
  }
  void flip(const char* file, std::size_t entry) {
    const std::size_t at = disk_.image().at(file).find(entries_[entry].bytes);
    ASSERT_NE(at, std::string::npos);
    disk_.flip_bit(file, 8 * at + 3);
  }
  MemoryDisk disk_{1};
  std::vector<JournalEntry> entries_ = [] {
    std::vector<JournalEntry> entries = some_entries(5, 60);
    for (JournalEntry& entry : entries) entry.bytes += "an entry is as long as this at least";
    return entries;
  }();
  MemoryDisk::Image before_;
};

TEST_F(LogTest, HasTheNewestEntriesTwiceAndNothingElseHasThem) {
  make_killed();
  for (const auto& [name, bytes] : disk_.image()) {
    const bool has = bytes.find(entries_[59].bytes) != std::string::npos;
    EXPECT_EQ(has, name == kLog || name == kMirror) << name;
  }
  EXPECT_THAT(expect_whole(), IsEmpty());
}

TEST_F(LogTest, DamageToOneOfItsFilesIsReadFromTheOther) {
  make_killed();
  const MemoryDisk::Image killed = disk_.image();
  for (const char* file : {kLog, kMirror}) {
    const char* other = file == kLog ? kMirror : kLog;
    SCOPED_TRACE(file);
    const auto with = [&](const std::string& what) {
      return std::string(file) + " " + what + "; its entries were read from " + other;
    };
    disk_.load(killed);
    flip(file, 50);
    EXPECT_THAT(expect_whole(), ElementsAre(with("is damaged")));
    disk_.load(killed);
    disk_.cut(file, killed.at(file).find(entries_[56].bytes));
    EXPECT_THAT(expect_whole(), ElementsAre(with("was cut")));
    disk_.load(killed);
    disk_.cut(file, 0);
    EXPECT_THAT(expect_whole(), ElementsAre(with("is damaged")));
    disk_.load(killed);
    ASSERT_TRUE(disk_.remove(file));
    EXPECT_THAT(expect_whole(), ElementsAre(with("is missing")));
    disk_.load(killed);
    disk_.put(file, before_.at(file));
    expect_whole();
  }
}

TEST_F(LogTest, DamageToBothIsNamedWithTheEntriesThatAreMissing) {
  make_killed();
  for (const char* file : {kLog, kMirror}) flip(file, 50);
  EXPECT_THAT(expect_closed(50),
              HasSubstr("goes to event 50, but its log vouches for event 60: 10 entries are missing"));
  const auto recovered = salvage_journal(kFile, "/room/new", &disk_);
  ASSERT_TRUE(recovered);
  EXPECT_EQ(recovered->head.seq, RoomSeq{50});
  EXPECT_EQ(recovered->lost(), 10u);
  Journal journal = std::move(Journal::open("/room/new", options()).value());
  EXPECT_GT(journal.next_server_epoch().value(), 1000u);
}

TEST_F(LogTest, ItsLossIsNamed) {
  make_killed();
  const MemoryDisk::Image killed = disk_.image();
  for (const char* file : {kLog, kMirror}) ASSERT_TRUE(disk_.remove(file));
  EXPECT_THAT(expect_closed(40),
              HasSubstr("its log is missing: how many entries are missing after event 40 cannot be told"));
  disk_.load(killed);
  for (const char* file : {kLog, kMirror}) disk_.cut(file, 0);
  EXPECT_THAT(expect_closed(40), HasSubstr("is damaged"));
  EXPECT_THAT(verify_journal(kFile, &disk_)->faults, Contains(HasSubstr("after event 40 cannot be told")));
  // Cut behind the first sector and at the end of an entry, the rest looks like a log with fewer entries.
  for (const std::size_t entry : {40, 50}) {
    disk_.load(killed);
    for (const char* file : {kLog, kMirror})
      disk_.cut(file, entry == 40
                          ? 4096
                          : killed.at(file).find(entries_[entry - 1].bytes) + entries_[entry - 1].bytes.size() + 16);
    EXPECT_THAT(expect_closed(entry), HasSubstr("was cut"));
    EXPECT_THAT(verify_journal(kFile, &disk_)->faults,
                Contains(HasSubstr("after event " + std::to_string(entry) + " cannot be told")));
  }
}

TEST_F(LogTest, IsNotReadWhereItIsLongerThanAnyLog) {
  const test::TempDir folder;
  const fs::path file = folder / "journal";
  ASSERT_TRUE(Journal::create(file, "bone")->append(std::span(entries_).first(5)));
  fs::resize_file(log_of(file), std::uintmax_t{8} << 40);
  const auto report = verify_journal(file);
  ASSERT_TRUE(report && report->sound());
  EXPECT_THAT(report->notes, ElementsAre(HasSubstr("journal-log is longer than any log; its entries were read from")));
}

// In version 3, the first sector contained neither the length of the files nor the signer.
TEST_F(LogTest, ReadsTheFilesOfVersion3) {
  make_killed();
  constexpr std::size_t kEnd = 104, kChecksum = 16;
  for (const char* file : {kLog, kMirror}) {
    std::string bytes = disk_.image().at(file);
    bytes.replace(0, 8, "OsteonL1");
    Hasher hasher;
    hasher.bytes(std::as_bytes(std::span(bytes).first(kEnd)));
    const Digest digest = hasher.finish();
    bytes.replace(kEnd, kChecksum, std::string(digest.bytes.begin(), digest.bytes.begin() + kChecksum));
    disk_.put(file, bytes);
  }
  EXPECT_THAT(expect_whole(), IsEmpty());
}

TEST_F(LogTest, AnOlderDatabaseBesideANewerLogIsNamed) {
  MemoryDisk::Image earlier;
  {
    Journal journal = std::move(Journal::create(kFile, "bone", options()).value());
    append(journal, entries_, 0, 20);
    ASSERT_TRUE(journal.next_server_epoch());
    earlier = disk_.image();
    append(journal, entries_, 20, 40);
    ASSERT_TRUE(journal.next_server_epoch());
    append(journal, entries_, 40, 60);
  }
  disk_.put(kFile, earlier.at(kFile));
  EXPECT_THAT(expect_closed(20),
              HasSubstr("goes to event 20, but its log vouches for event 60: 40 entries are missing"));
  for (const char* file : {kLog, kMirror}) disk_.put(file, earlier.at(file));
  EXPECT_EQ(Journal::open(kFile, options())->head().seq, RoomSeq{20})
      << "this is an older copy of all files, which only witnesses can detect";
}

TEST_F(LogTest, AnOlderLogBesideANewerDatabaseIsNamed) {
  MemoryDisk::Image earlier;
  {
    Journal journal = std::move(Journal::create(kFile, "bone", options()).value());
    append(journal, entries_, 0, 20);
    earlier = disk_.image();
    ASSERT_TRUE(journal.next_server_epoch());
    append(journal, entries_, 20, 60);
  }
  for (const char* file : {kLog, kMirror}) disk_.put(file, earlier.at(file));
  EXPECT_THAT(expect_closed(20),
              HasSubstr("its log is an older copy: how many entries are missing after event 20 cannot be told"));
}

TEST_F(LogTest, IsNotTakenFromAnotherJournalThatBeganAlike) {
  make_killed();
  const MemoryDisk::Image killed = disk_.image();
  disk_.load({});
  make_killed();
  for (const char* file : {kLog, kMirror}) disk_.put(file, killed.at(file));
  EXPECT_THAT(expect_closed(40), HasSubstr("belongs to another journal"));
}

TEST_F(LogTest, FailsTheRoomWhoseFilesAreExchangedCutOrRemoved) {
  const std::vector<std::pair<const char*, const char*>> damages{
      {"removed", "removed"}, {"replaced", "replaced or cut"}, {"cut", "replaced or cut"}};
  for (const char* file : {kFile, kLog, kMirror})
    for (const auto& [what, said] : damages) {
      disk_.load({});
      Journal journal = std::move(Journal::create(kFile, "bone", options()).value());
      append(journal, entries_, 0, 40);
      const MemoryDisk::Image now = disk_.image();
      if (std::string_view(what) == "removed") {
        ASSERT_TRUE(disk_.remove(file));
      }
      if (std::string_view(what) == "replaced") disk_.put(file, now.at(file));
      if (std::string_view(what) == "cut") disk_.cut(file, now.at(file).size() - 1);
      const Result<void> done = journal.append({&entries_[40], 1});
      ASSERT_FALSE(done) << file << " " << what;
      EXPECT_THAT(done.error().message, HasSubstr(said)) << file;
      EXPECT_NE(journal.closed_because(), nullptr);
    }
}

// The entry has the largest allowed size, and contains bytes that look like an entry of a log.
TEST_F(LogTest, TakesAnEntryThatIsLargerThanItself) {
  {
    Journal journal = std::move(Journal::create(kFile, "bone", options()).value());
    append(journal, entries_, 0, 59);
    entries_[59].bytes = disk_.image().at(kLog) + disk_.image().at(kMirror);
    append(journal, entries_, 59, 60);
    EXPECT_EQ(journal.head(), plain_head("bone", entries_));
  }
  EXPECT_THAT(expect_whole(), IsEmpty());
  EXPECT_LT(disk_.size(kLog).value().value(), 200u << 10) << "the entry was moved into the database";
}

std::map<std::string, std::string> contents_of(const fs::path& folder) {
  std::map<std::string, std::string> all;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::ostringstream bytes;
    bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    all[entry.path().filename().string()] = std::move(bytes).str();
  }
  return all;
}

// Any file beside the journal may be removed: the journal file itself is locked.
TEST(JournalSecondOpener, IsRefusedAndChangesNoByte) {
  const test::TempDir folder;
  const fs::path file = folder / "journal";
  const std::vector<JournalEntry> entries = some_entries(3, 20);
  Journal journal = std::move(Journal::create(file, "bone").value());
  append(journal, entries, 0, 10);
  for (const char* end : {".lock", "-wal"}) fs::remove(file.string() + end);
  const auto before = contents_of(folder.path());
  const std::string in_use = file.string() + " is in use by another process; close the room there first";
  EXPECT_EQ(Journal::open(file).error().message, in_use);
  EXPECT_EQ(Journal::open_to_read(file).error().message, in_use);
  EXPECT_EQ(Journal::create(file, "bone").error().code, ErrorCode::exists);
  EXPECT_EQ(verify_journal(file).error().message, in_use);
  EXPECT_EQ(backup_journal(file, folder / "copy").error().message, in_use);
  EXPECT_EQ(migrate_journal(file, folder / "copy").error().message, in_use);
  EXPECT_EQ(salvage_journal(file, folder / "copy").error().message, in_use);
  EXPECT_EQ(delete_journals({file}).error().message, in_use);
  EXPECT_EQ(contents_of(folder.path()), before);
  append(journal, entries, 10, 20);
  EXPECT_TRUE(equal(entries_of(journal), entries));
}

TEST(JournalReaders, WriteNothingAndMayBeMany) {
  const test::TempDir folder;
  const fs::path file = folder / "journal";
  const std::vector<JournalEntry> entries = some_entries(4, 30);
  for (const bool closed : {false, true}) {
    fs::remove(file);
    {
      Journal journal = std::move(Journal::create(file, "bone").value());
      append(journal, entries, 0, 30);
      if (closed) {
        ASSERT_TRUE(journal.close());
      }
    }
    const auto before = contents_of(folder.path());
    {
      Journal one = std::move(Journal::open_to_read(file).value());
      Journal two = std::move(Journal::open_to_read(file).value());
      EXPECT_EQ(Journal::open(file).error().code, ErrorCode::exists);
      EXPECT_TRUE(verify_journal(file)->sound());
      EXPECT_TRUE(equal(entries_of(one), entries));
      EXPECT_TRUE(equal(entries_of(two), entries));
      const JournalEntry next{RoomSeq{31}, 0, "next"};
      EXPECT_THAT(one.append({&next, 1}).error().message, HasSubstr("was opened only to be read"));
      EXPECT_EQ(one.closed_because(), nullptr);
    }
    EXPECT_EQ(contents_of(folder.path()), before);
    if (!closed) {
      for (const char* end : {"-log", "-mirror", "-wal"}) fs::remove(file.string() + end);
    }
  }
}

class EarlierVersion : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Migration, EarlierVersion, ::testing::Values(2, 3));

TEST_P(EarlierVersion, OpensAsItIs) {
  const test::TempDir folder;
  const fs::path file = folder / "journal";
  const std::vector<JournalEntry> entries = some_entries(12, 31);
  ASSERT_NO_FATAL_FAILURE(
      make_old_journal(file, GetParam(), {entries.begin(), entries.begin() + 30}, RowsIn::sqlites_log));
  const auto before = contents_of(folder.path());
  const auto verified = verify_journal(file);
  ASSERT_TRUE(verified) << verified.error().message;
  EXPECT_THAT(verified->faults, IsEmpty());
  EXPECT_EQ(verified->version, GetParam());
  EXPECT_EQ(verified->head.seq, RoomSeq{30});
  EXPECT_EQ(contents_of(folder.path()), before);
  {
    Journal journal = std::move(Journal::open(file).value());
    EXPECT_EQ(journal.closed_because(), nullptr);
    append(journal, entries, 30, 31);
  }
  EXPECT_EQ(verify_journal(file)->version, 4);
  Journal journal = std::move(Journal::open(file).value());
  EXPECT_TRUE(equal(entries_of(journal), entries));
}

}  // namespace
}  // namespace osteon
