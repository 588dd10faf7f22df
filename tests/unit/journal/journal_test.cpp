// The journal as the room uses it, on a disk in memory and on the computer's own.
#include "server/journal/journal.hpp"

#include <gmock/gmock.h>
#include <sqlite3.h>

#include <algorithm>
#include <fstream>
#include <numeric>
#include <sstream>

#include "server/journal/maintenance.hpp"
#include "tests/support/disk/journal_trials.hpp"
#include "tests/support/disk/memory_disk.hpp"
#include "tests/support/privileges.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/journal/entries.hpp"

namespace osteon {
namespace {

using test::MemoryDisk;
using test::plain_head;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class JournalTest : public ::testing::Test {
 protected:
  Journal create() { return std::move(Journal::create(kFile, "bone", options()).value()); }
  Journal reopen() { return std::move(Journal::open(kFile, options()).value()); }
  JournalOptions options() { return {.disk = &disk_}; }
  MemoryDisk disk_{1};
};

// Computed with Python's hashlib from the definition in chain.hpp.
TEST(JournalChain, IsAsDocumented) {
  const JournalHead none = first_head("bone");
  EXPECT_EQ(to_hex(none.chain), "76315a6e8df2e7e5be7c5e2d969b2e8d752c0a1f91f230eaa9f407b8f851caba");
  const JournalHead one = next_head(none, {RoomSeq{1}, 5, "first"});
  EXPECT_EQ(to_hex(one.chain), "a2fb508b017c3da4f05b3ad7c3efa0f09ce3d65466b578c5141cc399c7fcc098");
  const JournalHead two = next_head(one, {RoomSeq{2}, -1, ""});
  EXPECT_EQ(to_hex(two.chain), "7095729f8ccdba13c88177a1c3fd27d6162c0df3c0e06fbd380899036dad1611");
  EXPECT_EQ(two.seq, RoomSeq{2});
}

TEST_F(JournalTest, GivesBackWhatItWasGivenAfterItsProcessWasKilledAndAfterItWasClosed) {
  const std::vector<JournalEntry> entries = some_entries(1, 40);
  {
    Journal journal = create();
    append(journal, entries, 0, 20);
  }
  {
    Journal journal = reopen();
    EXPECT_EQ(journal.closed_because(), nullptr);
    EXPECT_EQ(journal.genesis(), "bone");
    EXPECT_EQ(journal.head(), plain_head("bone", {entries.begin(), entries.begin() + 20}));
    append(journal, entries, 20, 40);
    ASSERT_TRUE(journal.close());
  }
  EXPECT_THAT(disk_.image(), SizeIs(1)) << "a closed journal is one file";
  Journal journal = reopen();
  EXPECT_EQ(journal.head(), plain_head("bone", entries));
  EXPECT_TRUE(equal(entries_of(journal), entries));
  EXPECT_TRUE(equal(entries_of(journal, 33), {entries.begin() + 32, entries.end()}));
  int taken = 0;
  ASSERT_TRUE(journal.read(RoomSeq{5}, [&](const JournalEntry&) { return ++taken < 3; }));
  EXPECT_EQ(taken, 3);
}

TEST_F(JournalTest, IsMadeOnceAndOpenedOnlyWhereItIs) {
  const auto missing = Journal::open(kFile, options());
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
  { Journal journal = create(); }
  const auto again = Journal::create(kFile, "bone", options());
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::exists);

  EXPECT_THAT(again.error().message, HasSubstr("there is /room/journal already; give the new journal another name"));

  // The log of another journal of that name would be read as the new journal's log.
  ASSERT_TRUE(disk_.remove(kFile));
  const auto haunted = Journal::create(kFile, "bone", options());
  ASSERT_FALSE(haunted);
  EXPECT_EQ(haunted.error().code, ErrorCode::exists);
  EXPECT_THAT(haunted.error().message, HasSubstr("/room/journal-log belonged to an earlier journal"));
}

TEST_F(JournalTest, TakesNoEntryAboveTheLimitAndGoesOn) {
  JournalOptions small = options();
  small.most_entry_bytes = 100;
  Journal journal = std::move(Journal::create(kFile, "bone", small).value());
  const std::vector<JournalEntry> entries{{RoomSeq{1}, 0, std::string(100, 'a')},
                                          {RoomSeq{2}, 0, std::string(101, 'b')}};
  const Result<void> refused = journal.append(entries);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(refused.error().message, HasSubstr("entry 2 has 101 bytes"));
  EXPECT_EQ(journal.head().seq, RoomSeq{0});
  EXPECT_EQ(journal.closed_because(), nullptr);
  EXPECT_TRUE(journal.append({entries.data(), 1}));
}

TEST_F(JournalTest, AbortsOnASequenceNumberThatIsNotTheNext) {
  Journal journal = create();
  const JournalEntry skipping{RoomSeq{2}, 0, ""};
  EXPECT_DEATH(static_cast<void>(journal.append({&skipping, 1})), "broken promise");
}

TEST_F(JournalTest, HoldsWitnessesAgainstItsHistory) {
  const std::vector<JournalEntry> entries = some_entries(2, 5);
  Journal journal = create();
  append(journal, entries, 0, 5);
  for (std::size_t n = 0; n <= entries.size(); ++n)
    EXPECT_TRUE(
        journal.check_witness(plain_head("bone", {entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(n)})));

  const Result<void> other = journal.check_witness(plain_head("other bone", {entries.begin(), entries.begin() + 3}));
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::invalid_input);
  EXPECT_EQ(journal.closed_because(), nullptr) << "one client's mistake closes no room";

  const Result<void> ahead = journal.check_witness({RoomSeq{6}, journal.head().chain});
  ASSERT_FALSE(ahead);
  EXPECT_EQ(ahead.error().code, ErrorCode::unavailable);
  EXPECT_THAT(ahead.error().message, HasSubstr("goes to event 5, but a client was told that event 6 is durable"));
  ASSERT_NE(journal.closed_because(), nullptr);
  const JournalEntry next{RoomSeq{6}, 0, ""};
  EXPECT_FALSE(journal.append({&next, 1}));
  EXPECT_FALSE(journal.next_server_epoch());
  EXPECT_TRUE(equal(entries_of(journal), entries)) << "it can still be read";
}

TEST_F(JournalTest, KeepsTheNewestTwoCheckpoints) {
  const std::vector<JournalEntry> entries = some_entries(3, 4);
  std::vector<JournalHead> heads;
  {
    Journal journal = create();
    for (std::size_t n = 0; n < entries.size(); ++n) {
      append(journal, entries, n, n + 1);
      heads.push_back(journal.head());
      auto file = journal.begin_checkpoint(journal.head(), "meta " + std::to_string(n));
      ASSERT_TRUE(file);
      ASSERT_TRUE(file->write("room at "));
      ASSERT_TRUE(file->write(std::to_string(n)));
      ASSERT_TRUE(file->finish());
      ASSERT_TRUE(journal.add_checkpoint(std::move(*file)));
    }
    EXPECT_EQ(journal.begin_checkpoint(heads.back(), "").error().code, ErrorCode::exists);
    EXPECT_EQ(journal.begin_checkpoint({RoomSeq{2}, heads.back().chain}, "").error().code, ErrorCode::invalid_input);
    EXPECT_EQ(journal.begin_checkpoint({RoomSeq{5}, heads.back().chain}, "").error().code, ErrorCode::invalid_input);
    // This one is given up.
    append(journal, {{RoomSeq{5}, 0, "x"}}, 0, 1);
    auto dropped = journal.begin_checkpoint(journal.head(), "");
    ASSERT_TRUE(dropped && dropped->write("half"));
  }
  EXPECT_THAT(disk_.image(), SizeIs(6)) << "the journal, its log, its mirror, SQLite's, two checkpoints";
  Journal journal = reopen();
  const auto checkpoints = journal.checkpoints();
  ASSERT_TRUE(checkpoints);
  ASSERT_THAT(*checkpoints, SizeIs(2));
  for (int i = 0; i < 2; ++i) {
    const Checkpoint& checkpoint = (*checkpoints)[static_cast<std::size_t>(i)];
    EXPECT_EQ(checkpoint.at, heads[static_cast<std::size_t>(3 - i)]);
    EXPECT_EQ(checkpoint.meta, "meta " + std::to_string(3 - i));
    EXPECT_EQ(journal.read_checkpoint(checkpoint).value(), "room at " + std::to_string(3 - i));
  }
  const std::filesystem::path newest = checkpoint_path(disk_, heads[3]);
  disk_.flip_bit(newest, 5);
  const auto spoiled = journal.read_checkpoint(checkpoints->front());
  ASSERT_FALSE(spoiled);
  EXPECT_THAT(spoiled.error().message, HasSubstr("is not what was written"));
}

// An older database with a newer checkpoint: the log with the entries between them is lost.
TEST_F(JournalTest, OpensForReadingOnlyWhereACheckpointKnowsMore) {
  const std::vector<JournalEntry> entries = some_entries(4, 9);
  MemoryDisk::Image earlier;
  {
    Journal journal = create();
    append(journal, entries, 0, 5);
    ASSERT_TRUE(journal.close());
    earlier = disk_.image();
    Journal later = reopen();
    append(later, entries, 5, 9);
    auto file = later.begin_checkpoint(later.head(), "");
    ASSERT_TRUE(file && file->finish() && later.add_checkpoint(std::move(*file)));
    ASSERT_TRUE(later.close());
  }
  disk_.put(kFile, earlier.at(kFile));
  {
    Journal journal = reopen();
    ASSERT_NE(journal.closed_because(), nullptr);
    EXPECT_EQ(journal.closed_because()->code, ErrorCode::unavailable);
    EXPECT_THAT(journal.closed_because()->message, HasSubstr("goes to event 5"));
    EXPECT_THAT(journal.closed_because()->message, HasSubstr("vouches for event 9: 4 entries are missing"));
    EXPECT_TRUE(equal(entries_of(journal), {entries.begin(), entries.begin() + 5}));
    EXPECT_FALSE(journal.append({&entries[5], 1}));
  }
  const auto report = salvage_journal(kFile, "/room/new", &disk_);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->head.seq, RoomSeq{5});
  EXPECT_EQ(report->lost(), 4u);
  Journal journal = std::move(Journal::open("/room/new", options()).value());
  EXPECT_EQ(journal.closed_because(), nullptr);
  EXPECT_EQ(journal.recovered_to(), RoomSeq{5});
  EXPECT_EQ(journal.check_witness(plain_head("bone", entries)).error().code, ErrorCode::unavailable);
  EXPECT_EQ(journal.closed_because(), nullptr) << "the loss is known and was accepted";
  append(journal, entries, 5, 6);
}

TEST_F(JournalTest, NeverGivesAServerEpochTwice) {
  std::uint64_t last = 0;
  for (int i = 0; i < 5; ++i) {
    Journal journal = i == 0 ? create() : reopen();
    for (int k = 0; k < 2; ++k) {
      const auto epoch = journal.next_server_epoch();
      ASSERT_TRUE(epoch);
      EXPECT_EQ(*epoch, last + 1);
      last = *epoch;
    }
    EXPECT_EQ(journal.find_register("none").value(), std::nullopt);
    ASSERT_TRUE(journal.set_register("retention_days", std::to_string(i)));
    EXPECT_EQ(journal.find_register("retention_days").value(), std::to_string(i));
    if (i % 2 == 0) {
      ASSERT_TRUE(journal.close());
    }
  }
}

TEST_F(JournalTest, TakesNothingAfterAFailedWriteNotEvenWhenOpenedAnew) {
  const std::vector<JournalEntry> entries = some_entries(5, 4);
  {
    Journal journal = create();
    append(journal, entries, 0, 2);
    disk_.fail_sync_at(1, EIO);
    const Result<void> failed = journal.append({&entries[2], 1});
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().code, ErrorCode::unavailable);
    EXPECT_THAT(failed.error().message, HasSubstr("cannot sync /room/journal-log: Input/output error"));
    EXPECT_EQ(journal.append({&entries[2], 1}).error().message, failed.error().message);
    EXPECT_EQ(journal.head().seq, RoomSeq{2});
    EXPECT_TRUE(equal(entries_of(journal), {entries.begin(), entries.begin() + 2}));
  }
  {
    Journal journal = reopen();
    ASSERT_NE(journal.closed_because(), nullptr);
    EXPECT_THAT(journal.closed_because()->message, HasSubstr("salvage it into a new journal"));
  }
  ASSERT_TRUE(salvage_journal(kFile, "/room/new", &disk_));
  Journal journal = std::move(Journal::open("/room/new", options()).value());
  EXPECT_EQ(journal.closed_because(), nullptr);
  EXPECT_GE(journal.head().seq, RoomSeq{2});
}

// Linux shows pages as written although their write has failed. When such a page is read again, it is as before, or
// empty.
TEST(JournalAfterAFailedWrite, BlamesItselfAndNoClientForWhatItsFileShows) {
  const std::vector<JournalEntry> entries = some_entries(8, 60);
  int failed = 0, shown_otherwise = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    MemoryDisk disk(seed, 512);
    Journal journal =
        std::move(Journal::create(kFile, "bone", {.disk = &disk, .log_bytes = 8 << 10, .page_bytes = 1024}).value());
    disk.fail_at(10 + 5 * seed, EIO);
    std::size_t safe = 0;
    while (safe < entries.size() && journal.append({&entries[safe], 1})) ++safe;
    if (journal.closed_because() == nullptr) continue;
    ++failed;
    for (std::size_t n = 1; n <= safe; ++n) {
      const auto end = entries.begin() + static_cast<std::ptrdiff_t>(n);
      const Result<void> known = journal.check_witness(plain_head("bone", {entries.begin(), end}));
      if (known) continue;
      ++shown_otherwise;
      ASSERT_EQ(known.error().message, journal.closed_because()->message) << "seed " << seed << ", place " << n;
    }
  }
  EXPECT_GT(failed, 20);
  EXPECT_GT(shown_otherwise, 0) << "no file showed anything else, so nothing was tested";
}

TEST_F(JournalTest, SaysThatTheDiskIsFull) {
  Journal journal = create();
  disk_.fail_write_at(1, ENOSPC, MemoryDisk::Lasting::from_then_on);
  const JournalEntry entry{RoomSeq{1}, 0, "x"};
  const Result<void> failed = journal.append({&entry, 1});
  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().message, HasSubstr("No space left on device"));
  EXPECT_THAT(failed.error().message, HasSubstr("make room on the disk"));
}

TEST_F(JournalTest, KeepsItsLogShort) {
  JournalOptions short_log = options();
  short_log.log_bytes = 64 << 10;
  Journal journal = std::move(Journal::create(kFile, "bone", short_log).value());
  const std::vector<JournalEntry> entries = some_entries(6, 600);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    append(journal, entries, i, i + 1);
    for (const char* name : {"/room/journal-log", "/room/journal-mirror"}) {
      EXPECT_GE(disk_.size(name).value().value(), 4096u + (64 << 10)) << "the log is created at its largest size";
      EXPECT_LT(disk_.size(name).value().value(), 4096u + (64 << 10) + 500) << "the limit and one append";
    }
  }
  EXPECT_GT(disk_.size(kFile).value().value(), std::uint64_t{64} << 10) << "earlier entries are in the database";
}

TEST_F(JournalTest, CutsItsLogWhenItIsTidied) {
  const std::vector<JournalEntry> entries = some_entries(9, 300, 10'000);
  {
    Journal journal = create();
    const auto in_database = [&](std::size_t entry) {
      return disk_.image().at(kFile).find(entries[entry].bytes.substr(0, 64)) != std::string::npos;
    };
    append(journal, entries, 0, 4);
    ASSERT_TRUE(journal.tidy());
    EXPECT_FALSE(in_database(3)) << "a few entries can wait";
    append(journal, entries, 4, 40);
    ASSERT_TRUE(journal.tidy());
    EXPECT_TRUE(in_database(39));
    append(journal, entries, 40, 300);
    EXPECT_TRUE(equal(entries_of(journal), entries));
  }
  Journal journal = reopen();
  EXPECT_EQ(journal.closed_because(), nullptr);
  EXPECT_TRUE(equal(entries_of(journal), entries));
}

// SQLite has the entries of this journal in memory.
TEST_F(JournalTest, AVerifyOfOneInUseReadsTheDisk) {
  const std::vector<JournalEntry> entries = some_entries(11, 30);
  {
    Journal journal = create();
    append(journal, entries, 0, 30);
    ASSERT_TRUE(journal.close());
  }
  Journal journal = reopen();
  ASSERT_TRUE(verify_journal(journal)->sound());
  ASSERT_GT(entries[19].bytes.size(), 8u);
  const std::size_t at = disk_.image().at(kFile).find(entries[19].bytes);
  ASSERT_NE(at, std::string::npos);
  disk_.flip_bit(kFile, 8 * at + 3);
  const auto report = verify_journal(journal);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->first_bad, RoomSeq{20});
  EXPECT_FALSE(report->sound());
}

// Erases a name among many. Some names moved from page to page as the table grew, and one was renamed.
void forget(Journal& journal, int people, const std::function<std::size_t(std::string_view)>& found) {
  const std::string name = "Wilhelmina Grubenmann";
  for (int i = 0; i < people; ++i) {
    const std::string label = i % 2 == 0 ? name + std::to_string(i) : "Someone else";
    const Person person{"p" + std::to_string((i * 37) % people), label, 100 + i % 2};
    ASSERT_TRUE(journal.set_person(person));
  }
  ASSERT_TRUE(journal.set_person({"p0", name + " renamed", 101}));
  const std::vector<JournalEntry> entries = some_entries(7, 50);
  append(journal, entries, 0, 50);
  EXPECT_GT(found(name), 0u);
  EXPECT_EQ(journal.erase_people_before(101).value(), static_cast<std::size_t>(people / 2 - 1));
  EXPECT_EQ(found(name + std::to_string(2)), 0u);
  EXPECT_GT(found(name + " renamed"), 0u);
  EXPECT_EQ(journal.erase_person("p0").value(), 1u);
  EXPECT_EQ(journal.erase_person("p0").value(), 0u);
  EXPECT_EQ(found(name), 0u);
  EXPECT_THAT(journal.people().value(), SizeIs(people / 2));
  EXPECT_TRUE(equal(entries_of(journal), entries));
  EXPECT_TRUE(verify_journal(journal).value().sound());
}

TEST_F(JournalTest, ErasesPeopleSoThatNoByteOfThemIsLeft) {
  Journal journal = create();
  forget(journal, 400, [&](std::string_view name) {
    std::size_t found = 0;
    for (const auto& [file, bytes] : disk_.image())
      for (std::size_t at = bytes.find(name); at != std::string::npos; at = bytes.find(name, at + 1)) ++found;
    return found;
  });
}

// When the tree of a large table moves entries from page to page, it leaves copies behind, a few in thousands of
// entries.
TEST(JournalPeople, AreErasedWhereverTheTreeHasPutThem) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    std::mt19937_64 random(seed);
    MemoryDisk disk(seed);
    Journal journal = std::move(Journal::create(kFile, "bone", {.disk = &disk}).value());
    std::vector<int> order(1500);
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), random);
    const auto set = [&](int i) {
      const std::string label =
          i % 2 == 0 ? "Wilhelmina" + std::string(random() % 70, 'x') : std::string(random() % 90, 'y');
      ASSERT_TRUE(journal.set_person({"p" + std::to_string(i), label, i % 2}));
    };
    for (const int i : order) {
      set(i);
      if (random() % 3 == 0) set(order[random() % order.size()]);
    }
    EXPECT_EQ(journal.erase_people_before(1).value(), 750u);
    for (const auto& [file, bytes] : disk.image())
      EXPECT_EQ(bytes.find("Wilhelmina"), std::string::npos) << seed << ", " << file;
  }
}

TEST(JournalOnDisk, ErasesPeopleSoThatNoByteOfThemIsLeft) {
  const test::TempDir folder;
  Journal journal = std::move(Journal::create(folder / "journal", "bone").value());
  forget(journal, 120, [&](std::string_view name) {
    std::size_t found = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
      std::ostringstream all;
      all << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      const std::string bytes = std::move(all).str();
      for (std::size_t at = bytes.find(name); at != std::string::npos; at = bytes.find(name, at + 1)) ++found;
    }
    return found;
  });
}

TEST(JournalOnDisk, WorksWithNamesThatAreNoWords) {
  const test::TempDir folder;
  const std::filesystem::path file = folder / "a room? 100%#1 'x' ü";
  const std::vector<JournalEntry> entries = some_entries(8, 30);
  {
    Journal journal = std::move(Journal::create(file, "bone").value());
    append(journal, entries, 0, 30);
    auto checkpoint = journal.begin_checkpoint(journal.head(), "m");
    ASSERT_TRUE(checkpoint && checkpoint->write("bytes") && checkpoint->finish());
    ASSERT_TRUE(journal.add_checkpoint(std::move(*checkpoint)));
  }
  EXPECT_TRUE(std::filesystem::exists(file));
  Journal journal = std::move(Journal::open(file).value());
  EXPECT_EQ(journal.closed_because(), nullptr);
  EXPECT_EQ(journal.head(), plain_head("bone", entries));
  EXPECT_EQ(journal.read_checkpoint(journal.checkpoints().value().front()).value(), "bytes");
}

TEST(JournalOnDisk, HasOneUserAtATime) {
  const test::TempDir folder;
  const std::filesystem::path file = folder / "journal";
  {
    Journal journal = std::move(Journal::create(file, "bone").value());
    const auto second = Journal::open(file);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::exists);
    EXPECT_EQ(second.error().message, file.string() + " is in use by another process; close the room there first");
    EXPECT_EQ(verify_journal(file).error().code, ErrorCode::exists);
  }
  EXPECT_TRUE(Journal::open(file));
}

std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  return names;
}

TEST(JournalOnDisk, IsNotTakenFromAnyFile) {
  const test::TempDir folder;
  const std::string magic("SQLite format 3\0", 16);
  const std::pair<std::string, const char*> cases[]{
      {"", "is empty"},
      {"short", "is no journal; name a file"},
      {"{\"case\": \"" + std::string(170, 'x') + "\"}", "is no journal; name a file"},
      {std::string(5000, 'x'), "is no journal; name a file"},
      {magic.substr(0, 9), "has been cut to 9 bytes"},
      {magic + std::string(300, '\1'), "has been cut to 316 bytes"}};
  for (const auto& [content, why] : cases) {
    std::ofstream(folder / "file", std::ios::binary | std::ios::trunc) << content;
    const auto opened = Journal::open(folder / "file");
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::invalid_input) << opened.error().message;
    EXPECT_THAT(opened.error().message, HasSubstr((folder / "file").string() + " " + why));
    EXPECT_EQ(verify_journal(folder / "file").error().message, opened.error().message);
    EXPECT_THAT(names_in(folder.path()), ElementsAre("file")) << "no file is created beside it";
  }
}

// While the other program has it locked.
TEST(JournalOnDisk, IsNotTakenFromAnotherProgramsDatabase) {
  const test::TempDir folder;
  sqlite3* other = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "file").c_str(), &other), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(other, "CREATE TABLE songs(name TEXT); BEGIN EXCLUSIVE", nullptr, nullptr, nullptr),
            SQLITE_OK);
  const auto opened = Journal::open(folder / "file");
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(opened.error().message, HasSubstr("is a database of another program, no journal"));
  EXPECT_FALSE(std::filesystem::exists(folder / "file.lock"));
  EXPECT_EQ(sqlite3_close(other), SQLITE_OK);
}

// Files that belong to an existing journal of this name are not named as the obstacle.
TEST(JournalOnDisk, NamesTheJournalThatIsInTheWay) {
  const test::TempDir folder;
  for (int i = 0; i < 16; ++i) {
    const std::string name = "journal" + std::to_string(i);
    for (const std::string& end : {std::string("-wal"), "-7-" + std::string(64, 'a') + ".checkpoint", std::string()})
      std::ofstream(folder / (name + end)) << "x";
    const auto made = Journal::create(folder / name, "bone");
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().message,
              "there is " + (folder / name).string() + " already; give the new journal another name");
  }
}

TEST(JournalOnDisk, SaysWhatItMayNotDoAndWhatToDoAboutIt) {
  using std::filesystem::perms;
  const test::TempDir folder;
  const auto file = folder / "journal", sub = folder / "sub";
  ASSERT_TRUE(Journal::create(file, "bone")->close());
  std::filesystem::create_directory(sub);
  const auto why = [](const Result<Journal>& journal) { return journal ? std::string() : journal.error().message; };
  const auto code = [](const Result<Journal>& journal) {
    return journal ? ErrorCode::cancelled : journal.error().code;
  };

  EXPECT_EQ(code(Journal::open(sub)), ErrorCode::invalid_input) << "so nobody creates a new journal there";
  EXPECT_THAT(why(Journal::open(sub)), AllOf(HasSubstr(sub.string()), HasSubstr("name a file, not a folder")));
  EXPECT_FALSE(std::filesystem::exists(folder / "sub.lock"));
  EXPECT_EQ(why(Journal::create(folder / "none" / "journal", "bone")),
            "there is no folder " + (folder / "none").string() + "; make it first");
  EXPECT_THAT(why(Journal::open(file / "journal")), HasSubstr("name a file in a folder"));

  const test::WithoutPrivileges anybody;
  std::filesystem::permissions(file, perms::none);
  EXPECT_THAT(why(Journal::open(file)), AllOf(HasSubstr(file.string()), HasSubstr("see to the permissions")));
  EXPECT_NE(code(Journal::open(file)), ErrorCode::not_found) << "so nobody creates a new journal there";
  EXPECT_FALSE(std::filesystem::exists(folder / "journal.lock"));
  std::filesystem::permissions(file, perms::owner_read);
  EXPECT_THAT(why(Journal::open(file)),
              HasSubstr(file.string() + " cannot be written to; see to its permissions, or copy it"));
  std::filesystem::permissions(sub, perms::owner_read | perms::owner_exec);
  EXPECT_THAT(why(Journal::create(sub / "journal", "bone")),
              HasSubstr("see to the permissions, or choose another place"));
  std::filesystem::permissions(sub, perms::owner_all);
}

}  // namespace
}  // namespace osteon
