// Who signed a journal: the key of its server, another key, or nobody.
#include "server/journal/signing.hpp"

#include <gmock/gmock.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <fstream>
#include <iterator>
#include <thread>

#include "server/journal/journal_file.hpp"
#include "server/journal/maintenance.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/journal/entries.hpp"
#include "tests/unit/journal/old_journals.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::shared_ptr<const SigningKeys> new_keys() { return std::make_shared<const SigningKeys>(SigningKey::make()); }

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_key_file(const fs::path& file, const std::string& content) {
  std::ofstream(file, std::ios::binary) << content;
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
}

unsigned mode_of(const fs::path& file) {
  struct stat found {};
  EXPECT_EQ(::stat(file.c_str(), &found), 0);
  return found.st_mode & 0777;
}

// RFC 8032, section 7.1, test 1.
TEST(SigningKey, IsThatOfTheStandard) {
  std::array<std::uint8_t, 32> seed{0x9d, 0x61, 0xb1, 0x9d, 0xef, 0xfd, 0x5a, 0x60, 0xba, 0x84, 0x4a,
                                    0xf4, 0x92, 0xec, 0x2c, 0xc4, 0x44, 0x49, 0xc5, 0x69, 0x7b, 0x32,
                                    0x69, 0x19, 0x70, 0x3b, 0xac, 0x03, 0x1c, 0xae, 0x7f, 0x60};
  EXPECT_EQ(to_hex(SigningKey::from_seed(seed).public_key()),
            "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a");
}

TEST(SigningKey, SignsOneMessage) {
  const SigningKey key = SigningKey::make(), other = SigningKey::make();
  Digest message;
  message.bytes[3] = 7;
  Signature signature = key.sign(message);
  EXPECT_TRUE(verifies(key.public_key(), message, signature));
  EXPECT_FALSE(verifies(other.public_key(), message, signature));
  message.bytes[3] = 8;
  EXPECT_FALSE(verifies(key.public_key(), message, signature));
  message.bytes[3] = 7;
  signature.bytes[40] ^= 1;
  EXPECT_FALSE(verifies(key.public_key(), message, signature));
}

TEST(SigningKeyFile, IsMadeOnceForItsOwnerAlone) {
  const test::TempDir folder;
  const fs::path file = folder / "signing.key";
  EXPECT_EQ(load_signing_keys(file).error().code, ErrorCode::not_found);
  const auto made = load_or_make_signing_keys(file);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(mode_of(file), 0600u);
  EXPECT_EQ((*load_or_make_signing_keys(file))->key().public_key(), (*made)->key().public_key());
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1)
      << "a temporary file is left";

  fs::permissions(file, fs::perms::group_read, fs::perm_options::add);
  const auto open_to_others = load_or_make_signing_keys(file);
  ASSERT_FALSE(open_to_others);
  EXPECT_THAT(open_to_others.error().message, HasSubstr("chmod 600 " + file.string()));
}

TEST(SigningKeyFile, IsTheSameForServersThatStartAtOnce) {
  const test::TempDir folder;
  std::vector<PublicKey> keys(8);
  std::vector<std::thread> servers;
  for (PublicKey& key : keys)
    servers.emplace_back([&] { key = (*load_or_make_signing_keys(folder / "signing.key"))->key().public_key(); });
  for (std::thread& server : servers) server.join();
  for (const PublicKey& key : keys) EXPECT_EQ(key, keys.front());
}

TEST(SigningKeyFile, SaysWhichLineIsWrong) {
  const test::TempDir folder;
  const fs::path file = folder / "signing.key", other = folder / "other.key";
  ASSERT_TRUE(load_or_make_signing_keys(file) && rotate_signing_keys(file));
  const std::string good = content_of(file);
  const auto refused = [&](const std::string& content) {
    write_key_file(other, content);
    const auto loaded = load_signing_keys(other);
    EXPECT_FALSE(loaded) << content;
    return loaded ? std::string() : loaded.error().message;
  };
  EXPECT_THAT(refused("PEM\n"), HasSubstr("other.key:1 is not"));
  EXPECT_THAT(refused(""), HasSubstr("has no secret"));
  std::string changed = good;
  changed[good.find("secret ") + 7] = 'x';
  EXPECT_THAT(refused(changed), HasSubstr("other.key:3 is not the only secret of 64 hexadecimal digits"));
  changed = good;
  char& digit = changed[good.find("succession ") + 300];
  digit = digit == '0' ? '1' : '0';
  EXPECT_THAT(refused(changed), HasSubstr("other.key:4 is no succession"));
  EXPECT_THAT(refused(good + "more\n"), HasSubstr("other.key:5 is neither"));
}

TEST(SigningKeyFile, KeepsTheLineOfItsKeys) {
  const test::TempDir folder;
  const fs::path file = folder / "signing.key";
  const PublicKey first = (*load_or_make_signing_keys(file))->key().public_key();
  const PublicKey second = (*rotate_signing_keys(file))->key().public_key();
  const auto third = rotate_signing_keys(file);
  ASSERT_TRUE(third) << third.error().message;
  EXPECT_EQ(mode_of(file), 0600u);
  EXPECT_TRUE((*third)->trusts(first) && (*third)->trusts(second));
  EXPECT_FALSE((*third)->trusts(SigningKey::make().public_key()));
  EXPECT_EQ(keys_of_line(first, (*third)->successions()).size(), 3u);
}

// What people did is private, whatever the umask.
TEST(JournalFiles, AreForTheirOwnerAlone) {
  const test::TempDir folder;
  const auto before = ::umask(0);
  {
    Journal journal = std::move(Journal::create(folder / "journal", "bone").value());
    append(journal, some_entries(1, 5), 0, 5);
    auto file = journal.begin_checkpoint(journal.head(), "meta");
    EXPECT_TRUE(file && file->finish() && journal.add_checkpoint(std::move(*file)));
    EXPECT_TRUE(load_or_make_signing_keys(folder / "signing.key"));
  }
  EXPECT_TRUE(backup_journal(folder / "journal", folder / "backup"));
  ::umask(before);
  int files = 0;
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    EXPECT_EQ(mode_of(entry.path()), 0600u) << entry.path();
    ++files;
  }
  EXPECT_EQ(files, 8) << "journal, log, mirror, write-ahead log, checkpoint, key, backup and its checkpoint";
}

// Somebody who puts a key of their own before or after another key has only one of the two signatures.
TEST(Succession, NeedsBothItsKeys) {
  const SigningKey ours = SigningKey::make(), theirs = SigningKey::make();
  for (const bool before : {false, true}) {
    Succession forged = before ? succeed(theirs, ours) : succeed(ours, theirs);
    (before ? forged.by_after : forged.by_before) = before ? forged.by_before : forged.by_after;
    EXPECT_EQ(keys_of_line(ours.public_key(), {&forged, 1}).size(), 1u);
  }
}

class SignedJournal : public ::testing::Test {
 protected:
  Journal open(const std::shared_ptr<const SigningKeys>& keys) {
    auto journal = Journal::open(file_, {.keys = keys});
    EXPECT_TRUE(journal) << journal.error().message;
    return std::move(*journal);
  }
  void write(const std::shared_ptr<const SigningKeys>& keys, std::size_t from, std::size_t to, bool close) {
    Journal journal =
        fs::exists(file_) ? open(keys) : std::move(Journal::create(file_, "bone", {.keys = keys}).value());
    for (std::size_t i = from; i < to; ++i) append(journal, entries_, i, i + 1);
    if (close) {
      ASSERT_TRUE(journal.close());
    }
  }
  Vouched vouched(const PublicKey& key) { return vouched(key, file_); }
  Vouched vouched(const PublicKey& key, const fs::path& file) {
    const auto report = verify_journal(file);
    EXPECT_TRUE(report && report->sound()) << (report ? report->faults.front() : report.error().message);
    return vouched_by(key, *report);
  }
  // As text, with "1-30" for each range.
  static std::vector<std::string> text_of(const std::vector<SignedRange>& ranges) {
    std::vector<std::string> texts;
    for (const SignedRange& one : ranges)
      texts.push_back(std::to_string(one.from.value) + "-" + std::to_string(one.to.value));
    return texts;
  }
  static std::vector<std::string> text_of(const std::vector<std::pair<RoomSeq, RoomSeq>>& ranges) {
    std::vector<std::string> texts;
    for (const auto& [from, to] : ranges) texts.push_back(std::to_string(from.value) + "-" + std::to_string(to.value));
    return texts;
  }
  void run_sql(const std::string& sql) {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file_.c_str(), &database), SQLITE_OK);
    char* why = nullptr;
    EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, &why), SQLITE_OK) << why;
    sqlite3_close(database);
  }

  test::TempDir folder_;
  fs::path file_ = folder_ / "journal";
  std::vector<JournalEntry> entries_ = some_entries(17, 60);
  std::shared_ptr<const SigningKeys> keys_ = new_keys();
  PublicKey key_ = keys_->key().public_key();
};

TEST_F(SignedJournal, IsVouchedForToItsEndHoweverItsServerEnded) {
  for (const bool close : {false, true, false}) {
    fs::remove_all(folder_.path());
    fs::create_directory(folder_.path());
    write(keys_, 0, 20, close);
    write(keys_, 20, 45, !close);
    const Vouched found = vouched(key_);
    EXPECT_TRUE(found.all()) << ::testing::PrintToString(found.other_seals);
    EXPECT_THAT(text_of(found.ranges), ElementsAre("1-45"));
    const Vouched by_another = vouched(SigningKey::make().public_key());
    EXPECT_THAT(by_another.ranges, IsEmpty());
    EXPECT_THAT(text_of(by_another.by_others), ElementsAre("1-45"));
  }
}

TEST_F(SignedJournal, IsVouchedForByNobodyWithoutAKey) {
  write(nullptr, 0, 20, true);
  EXPECT_THAT(text_of(vouched(key_).by_nobody), ElementsAre("1-20"));
  // A server with a key signs what it adds, not what it found.
  write(keys_, 20, 30, false);
  const Vouched found = vouched(key_);
  EXPECT_THAT(text_of(found.ranges), ElementsAre("21-30"));
  EXPECT_THAT(text_of(found.by_nobody), ElementsAre("1-20"));
  EXPECT_THAT(open(keys_).notes(), IsEmpty()) << "the second time the entries are known";
}

// The hash chain has no key, so a script can extend it.
TEST_F(SignedJournal, NamesEntriesThatAScriptAppended) {
  write(keys_, 0, 20, true);
  write(nullptr, 20, 50, true);
  const Vouched found = vouched(key_);
  EXPECT_THAT(text_of(found.ranges), ElementsAre("1-20"));
  EXPECT_THAT(text_of(found.by_nobody), ElementsAre("21-50"));
  {
    Journal journal = open(keys_);
    ASSERT_NE(journal.closed_because(), nullptr) << "it takes entries behind invented ones";
    EXPECT_THAT(journal.closed_because()->message, HasSubstr("signed the entries up to 20, but not entries 21 to 50"));
  }
  // Without the key nobody can make the server take them.
  ASSERT_TRUE(salvage_journal(file_, folder_ / "by a script"));
  EXPECT_NE(std::move(Journal::open(folder_ / "by a script", {.keys = keys_}).value()).closed_because(), nullptr);
  EXPECT_THAT(vouched(key_, folder_ / "by a script").other_seals, Contains("the register \"recovered\""));
  // Only the signed entries are salvaged.
  ASSERT_TRUE(salvage_journal(file_, folder_ / "signed", nullptr, {}, RoomSeq{20}, keys_));
  EXPECT_TRUE(vouched(key_, folder_ / "signed").all());
  // All entries are salvaged, on purpose. They are still not signed.
  ASSERT_TRUE(salvage_journal(file_, folder_ / "all", nullptr, {}, {}, keys_));
  file_ = folder_ / "all";
  write(keys_, 50, 60, true);
  const Vouched recovered = vouched(key_);
  EXPECT_THAT(text_of(recovered.ranges), ElementsAre("1-20", "51-60"));
  EXPECT_THAT(text_of(recovered.by_nobody), ElementsAre("21-50"));
  EXPECT_THAT(recovered.other_seals, IsEmpty());
}

// If somebody cuts the journal back to an earlier signature, no footer matches that sequence number.
TEST_F(SignedJournal, NamesAFooterThatAScriptWrote) {
  write(keys_, 0, 20, true);
  write(keys_, 20, 30, true);
  run_sql(
      "DELETE FROM rows WHERE place > 20; DELETE FROM signatures WHERE place > 20;"
      "DELETE FROM registers WHERE name IN ('footer', 'log generation')");
  write(nullptr, 0, 0, true);
  EXPECT_THAT(vouched(key_).other_seals, Contains("the footer"));
}

TEST_F(SignedJournal, IsNotVouchedForWhereNothingIsSigned) {
  ASSERT_TRUE(Journal::create(file_, "whatever")->close());
  EXPECT_FALSE(vouched(key_).all());
  ASSERT_TRUE(Journal::create(folder_ / "other", "whatever", {.keys = keys_})->close());
  EXPECT_TRUE(vouched(key_, folder_ / "other").all());
}

TEST_F(SignedJournal, NamesAPersonWhoWasExchanged) {
  write(keys_, 0, 5, false);
  {
    Journal journal = open(keys_);
    ASSERT_TRUE(journal.set_person({"1", "Anna", 20000}) && journal.set_person({"2", "Berta", 20000}) &&
                journal.close());
  }
  EXPECT_TRUE(vouched(key_).all());
  run_sql("UPDATE people SET label = 'Berta' WHERE pseudonym = '1'");
  EXPECT_THAT(verify_journal(file_)->faults, Contains(HasSubstr("the record of a person is damaged")));
  run_sql("UPDATE people SET label = 'Anna' WHERE pseudonym = '1'");
  ASSERT_TRUE(open(nullptr).set_person({"1", "Berta", 20000}));
  EXPECT_THAT(vouched(key_).other_seals, ElementsAre("the name of person 1"));
}

// The signature is of the attacker's own key, for entries that do not exist.
TEST_F(SignedJournal, IsRecoveredWithoutSignaturesThatDoNotFit) {
  write(keys_, 0, 20, true);
  const SigningKey theirs = SigningKey::make();
  const SignedEntries bogus = sign_entries(theirs, RoomSeq{1}, {RoomSeq{10}, Digest{}});
  const auto hex = [](const auto& bytes) {
    std::string text;
    for (const std::uint8_t byte : bytes) {
      char digits[3];
      std::snprintf(digits, sizeof digits, "%02x", byte);
      text += digits;
    }
    return "x'" + text + "'";
  };
  run_sql("INSERT INTO signatures VALUES(10, 1, " + hex(bogus.head.chain.bytes) + ", " + hex(bogus.key.bytes) + ", " +
          hex(bogus.signature.bytes) + ")");
  EXPECT_FALSE(verify_journal(file_)->sound());
  ASSERT_TRUE(salvage_journal(file_, folder_ / "recovered", nullptr, {}, {}, keys_));
  EXPECT_TRUE(vouched(key_, folder_ / "recovered").all());
}

TEST_F(SignedJournal, NamesEntriesThatAnotherKeySigned) {
  write(keys_, 0, 20, true);
  const auto others = new_keys();
  write(others, 20, 50, true);
  const Vouched found = vouched(key_);
  EXPECT_THAT(text_of(found.ranges), ElementsAre("1-20"));
  EXPECT_THAT(text_of(found.by_others), ElementsAre("21-50"));
  EXPECT_FALSE(found.all());
  EXPECT_THAT(text_of(vouched(others->key().public_key()).ranges), ElementsAre("21-50"));
}

TEST_F(SignedJournal, KnowsTheLineOfItsServersKeys) {
  const fs::path key_file = folder_ / "signing.key";
  const auto first = *load_or_make_signing_keys(key_file);
  write(first, 0, 20, false);
  const auto second = *rotate_signing_keys(key_file);
  write(second, 20, 30, false);
  const auto third = *rotate_signing_keys(key_file);
  write(third, 30, 40, true);
  for (const auto& keys : {first, second, third}) EXPECT_TRUE(vouched(keys->key().public_key()).all());
  EXPECT_FALSE(vouched(key_).all());
}

TEST_F(SignedJournal, KeepsItsSignaturesInABackup) {
  write(keys_, 0, 20, false);
  {
    Journal journal = open(keys_);
    auto file = journal.begin_checkpoint(journal.head(), "meta");
    ASSERT_TRUE(file && file->write("bytes") && file->finish() && journal.add_checkpoint(std::move(*file)));
    ASSERT_TRUE(journal.set_register("room name", "hip"));
    append(journal, entries_, 20, 30);
  }
  ASSERT_TRUE(backup_journal(file_, folder_ / "without key"));
  EXPECT_THAT(vouched(key_, folder_ / "without key").other_seals, ElementsAre("the footer"));
  ASSERT_TRUE(backup_journal(file_, folder_ / "backup", nullptr, keys_));
  const Vouched found = vouched(key_, folder_ / "backup");
  EXPECT_TRUE(found.all()) << ::testing::PrintToString(found.other_seals);
  EXPECT_THAT(text_of(found.ranges), ElementsAre("1-30"));
}

TEST_F(SignedJournal, KeepsItsSignaturesInACopyThatItsServerMakes) {
  write(keys_, 0, 20, false);
  Journal journal = open(keys_);
  append(journal, entries_, 20, 30);
  auto copy = JournalCopy::begin(journal, folder_ / "copy");
  ASSERT_TRUE(copy);
  while (!copy->step().value()) {
  }
  const Vouched found = vouched(key_, folder_ / "copy");
  EXPECT_TRUE(found.all()) << ::testing::PrintToString(found.other_seals);
  EXPECT_THAT(text_of(found.ranges), ElementsAre("1-30"));
}

// A branch would turn unsigned entries into entries of the server.
TEST_F(SignedJournal, SignsNoBranchOfEntriesThatItFound) {
  write(nullptr, 0, 20, true);
  Journal journal = open(keys_);
  append(journal, entries_, 20, 30);
  auto copy = JournalCopy::begin_branch(journal, folder_ / "branch", RoomSeq{30}, "another bone", {});
  ASSERT_TRUE(copy);
  while (!copy->step().value()) {
  }
  EXPECT_THAT(text_of(vouched(key_, folder_ / "branch").by_nobody), ElementsAre("1-30"));
}

TEST_F(SignedJournal, SignsABranchThatItsServerMakes) {
  write(keys_, 0, 20, true);
  Journal journal = open(keys_);
  auto copy = JournalCopy::begin_branch(journal, folder_ / "branch", RoomSeq{10}, "another bone", {});
  ASSERT_TRUE(copy);
  while (!copy->step().value()) {
  }
  EXPECT_THAT(text_of(vouched(key_, folder_ / "branch").ranges), ElementsAre("1-10"));
}

TEST_F(SignedJournal, TakesTheSignatureOfEarlierEntriesForNoOther) {
  write(keys_, 0, 20, true);
  const fs::path first = std::exchange(file_, folder_ / "other");
  entries_ = some_entries(18, 60);
  write(keys_, 0, 20, true);
  // The entries of the other journal with the signatures of the first.
  run_sql("ATTACH '" + first.string() +
          "' AS first; DELETE FROM signatures; INSERT INTO signatures SELECT * FROM first.signatures");
  const auto report = verify_journal(file_);
  ASSERT_TRUE(report);
  EXPECT_THAT(report->faults, Contains(HasSubstr("the signature at event 20 vouches for another history")));
}

TEST_F(SignedJournal, NamesASignatureThatNoKeyMade) {
  write(keys_, 0, 20, true);
  run_sql("UPDATE signatures SET since = 2 WHERE place = 20");
  EXPECT_THAT(verify_journal(file_)->faults, Contains(HasSubstr("the signature at event 20 is damaged")));
  run_sql("UPDATE signatures SET key = zeroblob(31) WHERE place = 20");
  EXPECT_THAT(verify_journal(file_)->faults, Contains(HasSubstr("the signature at event 20 is damaged")));
}

TEST_F(SignedJournal, VouchesForItsRegistersAndCheckpoints) {
  {
    write(keys_, 0, 20, false);
    Journal journal = open(keys_);
    ASSERT_TRUE(journal.set_register("room name", "hip"));
    EXPECT_TRUE(journal.is_vouched_for("room name").value());
    EXPECT_TRUE(journal.is_vouched_for("not there").value());
  }
  {
    Journal journal = open(nullptr);
    ASSERT_TRUE(journal.set_register("room name", "knee"));
    auto file = journal.begin_checkpoint(journal.head(), "meta");
    ASSERT_TRUE(file && file->finish() && journal.add_checkpoint(std::move(*file)));
  }
  {
    Journal journal = open(keys_);
    EXPECT_FALSE(journal.is_vouched_for("room name").value());
    EXPECT_FALSE(journal.is_vouched_for(journal.checkpoints()->front()))
        << "the server would use the bone of this checkpoint";
  }
  EXPECT_FALSE(open(new_keys()).is_vouched_for("room name").value());
  EXPECT_THAT(vouched(key_).other_seals, ElementsAre("the checkpoint at event 20", "the register \"room name\""));
}

// The signature of a register is not valid for another genesis.
TEST_F(SignedJournal, TakesNoRegisterOfAnotherJournal) {
  write(keys_, 0, 5, false);
  { ASSERT_TRUE(open(keys_).set_register("room name", "hip")); }
  const fs::path other = folder_ / "other";
  {
    Journal journal = std::move(Journal::create(other, "another bone", {.keys = keys_}).value());
    ASSERT_TRUE(journal.set_register("room name", "knee"));
    ASSERT_TRUE(journal.close());
  }
  { ASSERT_TRUE(open(keys_).close()); }
  run_sql("ATTACH '" + other.string() +
          "' AS other; INSERT OR REPLACE INTO registers SELECT * FROM other.registers WHERE name = 'room name'");
  EXPECT_THAT(verify_journal(file_)->faults, Contains(HasSubstr("its register room name is damaged")));
}

TEST_F(SignedJournal, GoesOnFromOneOfAnOldVersion) {
  ASSERT_NO_FATAL_FAILURE(make_old_journal(file_, 2, {entries_.begin(), entries_.begin() + 30}, RowsIn::sqlites_log));
  EXPECT_THAT(open(keys_).notes(), Contains(HasSubstr("entries 1 to 30 were not signed by this server's key")));
  write(keys_, 30, 40, false);
  const Vouched found = vouched(key_);
  EXPECT_THAT(text_of(found.by_nobody), ElementsAre("1-30"));
  EXPECT_THAT(text_of(found.ranges), ElementsAre("31-40"));
}

}  // namespace
}  // namespace osteon
