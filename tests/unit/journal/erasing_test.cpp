// Entries of which something was erased: the chain and its signatures still hold, and nobody else can replace an entry.
#include <gmock/gmock.h>
#include <sqlite3.h>

#include <fstream>
#include <sstream>

#include "server/journal/journal_file.hpp"
#include "server/journal/maintenance.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/journal/entries.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ErasingTest : public ::testing::Test {
 protected:
  Journal open(std::shared_ptr<const SigningKeys> keys) const {
    auto journal = Journal::open(file_, {.keys = std::move(keys)});
    EXPECT_TRUE(journal) << journal.error().message;
    return std::move(*journal);
  }
  void make(std::shared_ptr<const SigningKeys> keys) const {
    auto journal = Journal::create(file_, "genesis", {.keys = std::move(keys)});
    ASSERT_TRUE(journal) << journal.error().message;
    append(*journal, entries_, 0, entries_.size());
    ASSERT_TRUE(journal->close());
  }
  static std::optional<std::string> every_third(const JournalEntry& entry) {
    return entry.seq.value % 3 == 0 ? std::optional<std::string>("-") : std::nullopt;
  }
  void sql(const std::string& what) const {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file_.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, what.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
    sqlite3_close(database);
  }

  const test::TempDir temp_;
  const fs::path file_ = temp_ / "room.journal";
  const std::vector<JournalEntry> entries_ = some_entries(1, 90);
  const std::shared_ptr<const SigningKeys> keys_ = std::make_shared<const SigningKeys>(SigningKey::make());
};

TEST_F(ErasingTest, TheChainAndItsSignaturesHold) {
  make(keys_);
  Journal journal = open(keys_);
  const JournalHead head = journal.head();
  EXPECT_EQ(journal.erase_entries(every_third).value(), 30u);
  EXPECT_EQ(journal.head(), head);
  ASSERT_TRUE(journal.close());
  const auto report = verify_journal(file_);
  ASSERT_TRUE(report);
  EXPECT_THAT(report->faults, IsEmpty());
  EXPECT_TRUE(vouched_by(keys_->key().public_key(), *report).all());
  Journal again = open(keys_);
  EXPECT_EQ(again.closed_because(), nullptr);
  EXPECT_EQ(entries_of(again)[2].bytes, "-");
  EXPECT_EQ(entries_of(again)[3].bytes, entries_[3].bytes);
}

// No byte is left in pages that a table row was on before, although the replacement is longer, nor in the files of the
// log behind their end.
TEST_F(ErasingTest, NoByteOfWhatWasErasedIsLeft) {
  const std::string word = "Wilhelmina";
  std::vector<JournalEntry> rows = some_entries(2, 2000, 60);
  for (JournalEntry& row : rows) row.bytes = (row.seq.value % 3 == 0 ? word : "Other") + row.bytes;
  auto journal = Journal::create(file_, "genesis", {.keys = keys_});
  ASSERT_TRUE(journal) << journal.error().message;
  for (std::size_t i = 0; i < rows.size(); i += 20) append(*journal, rows, i, i + 20);
  const auto found = [&] {
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(temp_.path())) {
      std::ostringstream all;
      all << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      files += std::move(all).str().find(word) == std::string::npos ? 0 : 1;
    }
    return files;
  };
  EXPECT_GT(found(), 0u);
  const auto longer = [](const JournalEntry& row) {
    auto bytes = every_third(row);
    if (bytes) bytes->assign(200, '-');
    return bytes;
  };
  EXPECT_EQ(journal->erase_entries(longer).value(), 666u);
  EXPECT_EQ(found(), 0u) << "while the journal is open";
  ASSERT_TRUE(journal->close());
  EXPECT_EQ(found(), 0u);
}

TEST_F(ErasingTest, WithoutTheKeyNothingIsErased) {
  make(keys_);
  {
    Journal journal = open(nullptr);
    const auto erased = journal.erase_entries(every_third);
    ASSERT_FALSE(erased);
    EXPECT_EQ(erased.error().code, ErrorCode::denied);
    EXPECT_THAT(erased.error().message, HasSubstr("--signing-key"));
    ASSERT_TRUE(journal.close());
  }
  auto journal = Journal::open_to_read(file_);
  ASSERT_TRUE(journal);
  EXPECT_TRUE(equal(entries_of(*journal), entries_));
}

// Somebody who can write the file replaces an entry, and marks it as erased.
TEST_F(ErasingTest, AServerTakesNoEntriesThatSomebodyElseReplaced) {
  make(keys_);
  {
    auto file = JournalFile::open(file_, system_disk(), {});
    ASSERT_TRUE(file) << file.error().message;
    const std::vector<JournalEntry> other{{RoomSeq{3}, entries_[2].at_ns, "other"}};
    ASSERT_TRUE(file->erase(other));
    ASSERT_TRUE(file->database().commit());
    ASSERT_TRUE(file->database().carry_log());
  }
  EXPECT_FALSE(vouched_by(keys_->key().public_key(), *verify_journal(file_)).all());
  Journal journal = open(keys_);
  ASSERT_NE(journal.closed_because(), nullptr);
  EXPECT_THAT(journal.closed_because()->message, HasSubstr("replaced entries"));
}

// Also not in an entry that the server itself has erased from.
TEST_F(ErasingTest, TheReplacementOfAnEntryIsSealed) {
  make(keys_);
  {
    Journal journal = open(keys_);
    ASSERT_EQ(journal.erase_entries(every_third).value(), 30u);
    ASSERT_TRUE(journal.close());
  }
  sql("UPDATE rows SET bytes = CAST('other' AS BLOB) WHERE place = 3");
  const auto report = verify_journal(file_);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->first_bad, RoomSeq{3});
  sql("UPDATE rows SET bytes = CAST('-' AS BLOB) WHERE place = 3; UPDATE registers SET value = CAST('' AS BLOB) WHERE "
      "name = 'erased rows'");
  EXPECT_FALSE(verify_journal(file_)->sound());
}

}  // namespace
}  // namespace osteon
