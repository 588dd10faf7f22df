// The program's journal commands: what they must never replace, and what they report about a damaged journal.
#include <gmock/gmock.h>

#include <chrono>
#include <cstdint>
#include <fstream>
#include <iterator>

#include "common/volume/field_file.hpp"
#include "server/journal/maintenance.hpp"
#include "server/journal/signing.hpp"
#include "server/storage/room_owners.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/rooms/kept_room.hpp"

namespace osteon::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class JournalCommands : public ::testing::Test {
 protected:
  // A journal with some cuts of one person, then 40 marks.
  void SetUp() override {
    ASSERT_TRUE(test_block().save(dir_ / "case"));
    KeptCuts kept(file_, nullptr, "femur");
    ASSERT_EQ(kept.store->person("Anna").value(), 1u);
    kept.cut(4);
    for (int i = 0; i < 40; ++i)
      ASSERT_TRUE(
          kept.room->mark(kept.hand, std::to_string(kept.room->room_seq().value + 1) + "." + std::string(20, 'x')));
    kept.keep();
    last_ = kept.store->head().seq.value;
    ASSERT_TRUE(kept.store->close());
    whole_ = bytes_of(file_);
  }
  // Flips one bit of the tenth entry before the last.
  void damage() {
    bad_ = last_ - 10;
    std::string bytes = whole_;
    const std::size_t at = bytes.find(std::to_string(bad_) + "." + std::string(20, 'x'));
    ASSERT_NE(at, std::string::npos);
    bytes[at + 6] = static_cast<char>(bytes[at + 6] ^ 2);
    std::ofstream(file_, std::ios::binary | std::ios::trunc) << bytes;
  }
  RunResult server(const std::string& command, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {command, file_.string()});
    RunResult result = run(program("osteon-server"), arguments, std::chrono::seconds(60));
    EXPECT_FALSE(result.timed_out);
    return result;
  }
  void refused(const std::string& command, const std::vector<std::string>& arguments,
               const std::vector<std::string>& words) {
    const RunResult result = server(command, arguments);
    EXPECT_NE(result.exit_code, 0) << command << ": " << result.out;
    for (const std::string& word : words) EXPECT_THAT(result.err, HasSubstr(word)) << command;
  }
  void done(const std::string& command, const std::vector<std::string>& arguments) {
    const RunResult result = server(command, arguments);
    EXPECT_EQ(result.exit_code, 0) << command << ": " << result.err;
  }
  std::string make(const std::string& name, const std::string& bytes) {
    std::ofstream(dir_ / name, std::ios::binary) << bytes;
    return (dir_ / name).string();
  }
  bool there(const std::string& name) { return fs::exists(fs::symlink_status(dir_ / name)); }

  TempDir dir_;
  const fs::path file_ = dir_ / "femur.journal";
  std::uint64_t last_ = 0, bad_ = 0;
  std::string whole_;
};

TEST_F(JournalCommands, AnExportReplacesNothing) {
  const std::string notes = make("notes.txt", "of the day");
  refused("export", {notes}, {"there is " + notes + " already; give another name"});
  EXPECT_EQ(bytes_of(notes), "of the day");
  refused("export", {file_.string()}, {"give another name"});
  EXPECT_EQ(bytes_of(file_), whole_);
  fs::create_symlink(dir_ / "elsewhere", dir_ / "link");
  refused("export", {(dir_ / "link").string()}, {"already"});
  EXPECT_FALSE(there("elsewhere"));
  // Files that the next start would take for its own.
  for (const std::string end : {"-log", "-mirror", "-wal", ".failed", ".lock"}) {
    refused("export", {file_.string() + end}, {"give another name"});
    EXPECT_EQ(bytes_of(file_), whole_);
  }
  EXPECT_FALSE(there("femur.journal.failed"));
  const std::string partial = make("lines.partial", "of another export");
  refused("export", {(dir_ / "lines").string()}, {partial, "remove it"});
  EXPECT_EQ(bytes_of(partial), "of another export");
  refused("export", {(dir_ / "none" / "lines").string()}, {"there is no folder", "make it first"});

  done("export", {(dir_ / "all").string()});
  const std::string lines = bytes_of(dir_ / "all");
  EXPECT_EQ(std::ranges::count(lines, '\n'), static_cast<std::ptrdiff_t>(last_));
  EXPECT_FALSE(there("all.partial"));
}

TEST_F(JournalCommands, AnExportOfNobodyLeavesNoFile) {
  refused("export", {(dir_ / "of99").string(), "--person", "99"}, {"nothing of a person 99"});
  EXPECT_FALSE(there("of99") || there("of99.partial"));
  done("export", {(dir_ / "of1").string(), "--person", "1"});
  EXPECT_THAT(bytes_of(dir_ / "of1"), HasSubstr("Anna"));
}

TEST_F(JournalCommands, AReplayReplacesOnlyFields) {
  const std::string bone = (dir_ / "case").string(), notes = make("notes.txt", "of the day");
  const auto fields = [&](const std::string& file) {
    return std::vector<std::string>{"--case", bone, "--fields", file};
  };
  refused("replay", fields(notes), {"there is " + notes, "--fields another name"});
  EXPECT_EQ(bytes_of(notes), "of the day");
  refused("replay", fields(file_.string()), {"give another name"});
  EXPECT_EQ(bytes_of(file_), whole_);
  // The error comes before the long replay. The replay of a folder that is no case would end with another message.
  refused("replay", {"--case", (dir_ / "no case").string(), "--fields", (dir_ / "none" / "f.vdb").string()},
          {"there is no folder"});
  done("replay", fields((dir_ / "f.vdb").string()));
  const Result<SavedFields> first = load_fields(dir_ / "f.vdb");
  ASSERT_TRUE(first) << first.error().message;
  std::vector<std::string> earlier = fields((dir_ / "f.vdb").string());
  earlier.insert(earlier.end(), {"--to", "4"});
  done("replay", earlier);
  const Result<SavedFields> second = load_fields(dir_ / "f.vdb");
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(second->room_seq, RoomSeq{4});
  EXPECT_EQ(first->room_seq, RoomSeq{last_});
}

TEST_F(JournalCommands, ADamagedJournalIsSaidToBeOneAndGivesWhatIsConfirmed) {
  damage();
  const std::string fault = "entry " + std::to_string(bad_) + " does not fit the chain of hashes",
                    bone = (dir_ / "case").string();
  const std::string confirmed = std::to_string(bad_ - 1), beyond = std::to_string(bad_);
  const auto file = [&](const std::string& name) { return (dir_ / name).string(); };
  refused("replay", {"--case", bone}, {fault, "--to " + confirmed});
  refused("branch", {file("b")}, {fault, "--at " + confirmed});
  refused("export", {file("lines")}, {fault, "--to " + confirmed});
  refused("people", {}, {fault});
  EXPECT_THAT(server("people", {}).out, HasSubstr("Anna")) << "the readable part is there";
  refused("erase-person", {"--person", "1"}, {fault});
  refused("replay", {"--case", bone, "--to", beyond}, {"--to " + beyond, "that is confirmed"});
  refused("branch", {file("b"), "--at", beyond}, {confirmed});
  refused("export", {file("lines"), "--to", beyond}, {"that is confirmed"});
  EXPECT_FALSE(there("b") || there("lines") || there("lines.partial"));

  const RunResult replayed = server("replay", {"--case", bone, "--to", confirmed});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_THAT(replayed.out, AllOf(HasSubstr(fault), HasSubstr("room hash")));
  done("branch", {file("b"), "--at", confirmed});
  EXPECT_EQ(verify_journal(dir_ / "b")->head.seq.value, bad_ - 1);
  done("export", {file("lines"), "--to", confirmed});
  const std::string lines = bytes_of(dir_ / "lines");
  EXPECT_EQ(std::ranges::count(lines, '\n'), static_cast<std::ptrdiff_t>(bad_ - 1));
}

TEST_F(JournalCommands, ASoundOneStillVouchesForItsEndAfterwards) {
  const std::string bone = (dir_ / "case").string();
  done("replay", {"--case", bone});
  done("people", {});
  done("export", {(dir_ / "lines").string()});
  refused("export", {(dir_ / "of99").string(), "--person", "99"}, {"99"});
  const auto report = verify_journal(file_);
  ASSERT_TRUE(report);
  EXPECT_TRUE(report->sound() && report->closed_cleanly);
  EXPECT_EQ(report->witnessed.value, last_);
}

TEST_F(JournalCommands, NobodyUnknownIsErased) {
  refused("erase-person", {"--person", "77"}, {"nobody in", "has the number 77"});
  EXPECT_THAT(server("people", {}).out, HasSubstr("Anna"));
  done("erase-person", {"--person", "1"});
  EXPECT_THAT(server("people", {}).out, Not(HasSubstr("Anna")));
  refused("erase-person", {"--person", "1"}, {"has the number 1"});
  done("erase-person", {"--older-than", "1"});
  done("erase-person", {"--older-than", "0"});  // This erases everybody who joined before today, which is nobody.
  refused("erase-person", {}, {"either --person", "or --older-than"});
  refused("erase-person", {"--person", "2", "--older-than", "0"}, {"either --person", "or --older-than"});
}

// 0 days is a valid number of days.
TEST_F(JournalCommands, ErasingWhoCameBeforeTodayLeavesTheOthers) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto today = static_cast<std::int32_t>(std::chrono::duration_cast<std::chrono::days>(now).count());
  {
    Result<Journal> journal = Journal::open(file_);
    ASSERT_TRUE(journal.has_value()) << journal.error().message;
    ASSERT_TRUE(journal->set_person({"7", "Bert", today - 1}));
    ASSERT_TRUE(journal->set_person({"8", "Cora", today + 1}));
    ASSERT_TRUE(journal->close());
  }
  refused("erase-person", {"--older-than=-3"}, {"--older-than"});
  EXPECT_THAT(server("people", {}).out, AllOf(HasSubstr("Bert"), HasSubstr("Cora")));
  done("erase-person", {"--older-than", "0"});
  EXPECT_THAT(server("people", {}).out, AllOf(Not(HasSubstr("Bert")), HasSubstr("Cora")));
}

// Names and texts of an erased person are in no file of the folder, and in no copy of the journal.
TEST_F(JournalCommands, WhoIsErasedLeavesNoWords) {
  const auto keys = load_or_make_signing_keys(dir_ / "signing.key");
  ASSERT_TRUE(keys) << keys.error().message;
  const auto anywhere = [&](const std::string& text) {
    return std::ranges::any_of(fs::recursive_directory_iterator(dir_.path()), [&](const fs::directory_entry& one) {
      return one.is_regular_file() && bytes_of(one.path()).find(text) != std::string::npos;
    });
  };
  const auto hash_of = [](const std::string& said) { return said.substr(said.find("field hash"), 80); };
  const std::string mark(20, 'x'), before = hash_of(server("replay", {"--case", (dir_ / "case").string()}).out);
  ASSERT_TRUE(note_owner(file_, "Anna"));
  ASSERT_TRUE(anywhere(mark) && anywhere("Anna"));

  const RunResult forgotten = server("erase-person", {"--person", "1"});
  ASSERT_EQ(forgotten.exit_code, 0) << forgotten.err;
  EXPECT_THAT(forgotten.out, HasSubstr("the words of 44 events"));
  EXPECT_FALSE(anywhere(mark) || anywhere("Anna"));
  done("verify", {});
  EXPECT_EQ(hash_of(server("replay", {"--case", (dir_ / "case").string()}).out), before);
  for (const std::string& copy : {std::string("backup"), std::string("salvage")}) {
    done(copy, {(dir_ / copy).string()});
    EXPECT_EQ(run(program("osteon-server"), {"verify", (dir_ / copy).string()}).exit_code, 0) << copy;
  }
  done("branch", {(dir_ / "branched").string()});
  EXPECT_TRUE(verify_journal(dir_ / "branched")->sound());
  EXPECT_FALSE(anywhere(mark) || anywhere("Anna"));
}

TEST_F(JournalCommands, ASecondBackupNamesTheFirst) {
  done("backup", {(dir_ / "b.backup").string()});
  refused("backup", {(dir_ / "b.backup").string()}, {"there is " + (dir_ / "b.backup").string() + " already"});
}

// The file is neither served nor is a lock file left beside it.
TEST_F(JournalCommands, AFileThatIsNoJournalIsSaidToBeNone) {
  const std::string json = make("case.json", std::string("{\"a\": \"") + std::string(180, 'x') + "\"}");
  fs::create_directory(dir_ / "folder");
  for (const auto& [file, why] : {std::pair<std::string, std::string>{json, "is no journal; name a file"},
                                  {(dir_ / "folder").string(), "name a file, not a folder"}}) {
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"verify", file},
          {"people", file},
          {"backup", file, (dir_ / "copy").string()},
          {"--plain", "--listen", "127.0.0.1:0", "--case", (dir_ / "case").string(), "--journal", file}}) {
      const RunResult result = run(program("osteon-server"), arguments, std::chrono::seconds(60));
      EXPECT_FALSE(result.timed_out);
      EXPECT_NE(result.exit_code, 0);
      EXPECT_THAT(result.err, AllOf(HasSubstr(file), HasSubstr(why))) << arguments.front();
    }
    EXPECT_FALSE(fs::exists(file + ".lock"));
  }
}

}  // namespace
}  // namespace osteon::test
