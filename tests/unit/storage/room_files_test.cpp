// Rooms as files in a folder: reading a room that is in use, its people of now and before, its branches, its deletion.
#include "server/storage/room_files.hpp"

#include <gmock/gmock.h>

#include "tests/support/disk/memory_disk.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/rooms/kept_room.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;
using test::KeptCuts;
using test::MemoryDisk;
using test::test_block;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* kRoomFile = "/rooms/femur";

class RoomFilesTest : public ::testing::Test {
 protected:
  bool anywhere(const std::string& text) const {
    const MemoryDisk::Image image = disk_.image();
    return std::ranges::any_of(image, [&](const auto& file) { return file.second.find(text) != std::string::npos; });
  }
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& [name, bytes] : disk_.image()) all.push_back(name);
    return all;
  }
  MemoryDisk disk_{1};
};

TEST(RoomsFolder, IsOneServersAsLongAsItHoldsIt) {
  const test::TempDir dir;
  Result<std::unique_ptr<DiskLock>> first = lock_rooms(dir.path());
  ASSERT_TRUE(first) << first.error().message;
  const Result<std::unique_ptr<DiskLock>> second = lock_rooms(dir.path());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::exists);
  EXPECT_THAT(second.error().message,
              AllOf(HasSubstr(dir.path().string()), HasSubstr("--rooms"), HasSubstr("end that one first")));
  // Work on a journal that no server has open goes on beside the lock. The lock file is not taken for a room.
  KeptCuts kept(dir / "femur.journal", nullptr, "femur");
  kept.cut(3);
  ASSERT_TRUE(kept.store->close());
  ASSERT_TRUE(branch_journal(dir / "femur.journal", dir / "copy.journal", RoomSeq{}, "copy"));
  EXPECT_THAT(*branches_of(dir.path(), dir / "femur.journal"), SizeIs(1));
  EXPECT_TRUE(delete_room(dir / "femur.journal", true));
  first->reset();
  EXPECT_TRUE(lock_rooms(dir.path()));
}

TEST_F(RoomFilesTest, WhatAJournalBeganAsIsReadBesideWhoeverUsesIt) {
  KeptCuts kept(kRoomFile, &disk_, "femur");
  kept.cut(5);
  const MemoryDisk::Image before = disk_.image();
  const Result<RoomGenesis> peeked = peek_genesis(kRoomFile, &disk_);
  ASSERT_TRUE(peeked) << peeked.error().message;
  EXPECT_EQ(to_bytes(*peeked), to_bytes(kept.store->genesis()));
  EXPECT_EQ(disk_.image(), before);
  kept.cut(5);
  EXPECT_TRUE(kept.store->verify(test_block(), kept.bone())->sound());
  ASSERT_TRUE(kept.store->close());
  EXPECT_EQ(peek_genesis(kRoomFile, &disk_)->room, "femur");

  EXPECT_EQ(peek_genesis("/rooms/tibia", &disk_).error().code, ErrorCode::not_found);
  for (const std::string& bytes : {std::string(), std::string("a list"), std::string(4096, 'x')}) {
    disk_.put("/rooms/list", bytes);
    EXPECT_EQ(peek_genesis("/rooms/list", &disk_).error().code, ErrorCode::invalid_input);
  }
  std::string spoiled = disk_.image().at(kRoomFile);
  const std::size_t name = spoiled.find("femur");
  ASSERT_NE(name, std::string::npos);
  spoiled.replace(name, 5, "tibia");
  disk_.put("/rooms/list", spoiled);
  EXPECT_EQ(peek_genesis("/rooms/list", &disk_).error().code, ErrorCode::invalid_input) << "the seal does not match";
}

// The same with SQLite's locks on the computer's disk.
TEST(RoomFiles, APeekOnTheComputersDiskDisturbsNobody) {
  const test::TempDir folder;
  const fs::path file = folder.path() / "a room? 100 %#1";
  KeptCuts kept(file, nullptr, "femur");
  kept.cut(5);
  const Result<RoomGenesis> peeked = peek_genesis(file);
  ASSERT_TRUE(peeked) << peeked.error().message;
  EXPECT_EQ(peeked->room, "femur");
  kept.cut(5);
  EXPECT_TRUE(kept.store->verify(test_block(), kept.bone())->sound());
  ASSERT_TRUE(kept.store->close());
  EXPECT_TRUE(verify_journal(file)->sound());
}

TEST_F(RoomFilesTest, ARoomIsOpenedOnlyUnderItsName) {
  {
    KeptCuts kept(kRoomFile, &disk_, "femur");
    kept.cut(5);
    ASSERT_TRUE(kept.store->close());
  }
  RoomStore::Options options;
  options.journal.disk = &disk_;
  options.name = "tibia";
  const auto refused = RoomStore::open(kRoomFile, test_block(), options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message,
            std::string(kRoomFile) +
                " holds the room femur, not tibia; give the file its name again, or rename the room: "
                "osteon-server rename-room " +
                kRoomFile + " tibia");
  {
    Journal journal = std::move(Journal::open(kRoomFile, {.disk = &disk_}).value());
    ASSERT_TRUE(journal.set_register(kNameRegister, "tibia"));
    ASSERT_TRUE(journal.close());
  }
  const auto renamed = RoomStore::open(kRoomFile, test_block(), options);
  ASSERT_TRUE(renamed) << renamed.error().message;
  EXPECT_EQ(renamed->store->genesis().room, "tibia");
}

TEST_F(RoomFilesTest, WhoJoinedTooLongAgoIsErased) {
  std::int32_t today = 100;
  KeptCuts kept(kRoomFile, &disk_, "femur");
  kept.keep();
  kept.options.today = [&] { return today; };
  kept.options.retention_days = 30;
  kept.store.reset();
  kept.open(kRoomFile);
  ASSERT_EQ(kept.store->person("Anna Alt").value(), 1u);
  today = 120;
  ASSERT_EQ(kept.store->person("Bela Neu").value(), 2u);
  ASSERT_EQ(kept.store->person("Anna Alt").value(), 1u) << "she is still known";
  today = 130;
  EXPECT_EQ(kept.store->erase_old_people().value(), 0u) << "30 days are not more than 30 days";
  EXPECT_TRUE(anywhere("Anna Alt"));
  today = 131;
  EXPECT_EQ(kept.store->erase_old_people().value(), 1u);
  EXPECT_FALSE(anywhere("Anna Alt"));
  EXPECT_TRUE(anywhere("Bela Neu"));
  EXPECT_EQ(kept.store->person("Anna Alt").value(), 3u) << "the name no longer belongs to number 1";

  // The same when the room is opened.
  kept.cut(3);
  kept.store.reset();
  today = 151;
  kept.open(kRoomFile);
  EXPECT_FALSE(anywhere("Bela Neu"));
  EXPECT_THAT(kept.store->people().value(), ElementsAre(Person{"3", "Anna Alt", 131}));
  kept.store.reset();
  today = 100'000;
  kept.options.retention_days = 0;
  kept.open(kRoomFile);
  EXPECT_EQ(kept.store->erase_old_people().value(), 0u);
  EXPECT_TRUE(anywhere("Anna Alt")) << "the name stays for ever";
  EXPECT_TRUE(kept.store->erase_person(3).value());
  EXPECT_FALSE(kept.store->erase_person(3).value());
  EXPECT_FALSE(anywhere("Anna Alt"));
}

// Messages, labels and names of marks of one person, and what was decided about them and said to them.
TEST_F(RoomFilesTest, WordsGoWithThePersonAndTheChainStays) {
  KeptCuts kept(kRoomFile, &disk_, "femur");
  ASSERT_EQ(kept.store->person("Anna Alt").value(), 1u);
  ASSERT_EQ(kept.store->person("Bela Neu").value(), 2u);
  Room& room = *kept.room;
  const AuthorId anna = room.join(MemberKind::surgeon, 1, {}, Role::trainee);
  const AuthorId bela = room.join(MemberKind::watcher, 2, {}, Role::instructor);
  ASSERT_TRUE(room.mark(anna, "mark of Zwetschge"));
  ASSERT_TRUE(room.say(anna, {}, "spoken Zwetschge"));
  ASSERT_TRUE(room.say(bela, anna, "said to her: Zwetschge"));
  ASSERT_TRUE(room.say(bela, {}, "as anna alt said"));
  ASSERT_TRUE(room.say(bela, {}, "anna altmann is somebody else"));
  ASSERT_TRUE(room.supervise(bela, anna, {.stopped = true, .words = "stopped for Zwetschge"}));
  Annotation drawn;
  drawn.kind = AnnotationKind::label;
  drawn.points = {{1, 2, 3}};
  drawn.words = "label Zwetschge";
  ASSERT_TRUE(room.annotate(anna, drawn));
  drawn.words = "of another";
  ASSERT_TRUE(room.annotate(bela, drawn));
  kept.cut(3);
  const JournalHead head = kept.store->head();
  const Digest bone = room.field_hash();
  ASSERT_TRUE(anywhere("Zwetschge"));

  ASSERT_TRUE(kept.store->erase_person(1).value());
  for (const char* gone : {"Zwetschge", "Anna Alt", "as anna alt said"}) EXPECT_FALSE(anywhere(gone)) << gone;
  for (const char* stays : {"Bela Neu", "of another", "anna altmann is somebody else"})
    EXPECT_TRUE(anywhere(stays)) << stays;
  EXPECT_EQ(kept.store->head(), head);
  EXPECT_FALSE(kept.store->erase_person(1).value()) << "nothing is left to erase";

  // The room goes on. A replay of its entries makes the earlier room again.
  kept.cut(2);
  const Digest later = room.field_hash();
  ASSERT_TRUE(kept.store->close());
  kept.store.reset();
  const auto report = verify_journal(kRoomFile, &disk_);
  ASSERT_TRUE(report);
  EXPECT_THAT(report->faults, IsEmpty());
  EXPECT_THAT(report->notes, ElementsAre(HasSubstr("text was erased from")));
  kept.open(kRoomFile);
  EXPECT_EQ(kept.room->field_hash(), later);
  EXPECT_EQ(test::replay_of(test::entries_of(*kept.store, head.seq)).field_hash(), bone);
  EXPECT_FALSE(anywhere("Zwetschge"));
}

TEST_F(RoomFilesTest, APersonGetsAllThatThereIsOfIt) {
  KeptCuts kept(kRoomFile, &disk_, "femur");
  ASSERT_EQ(kept.store->person("Anna \"A\"\n").value(), 1u);
  ASSERT_EQ(kept.store->person("Bela").value(), 2u);
  kept.cut(4);  // By 1: its join, 4 cuts, 4 marks.
  const AuthorId other = kept.room->join(MemberKind::surgeon, 2), nobody = kept.room->join(MemberKind::watcher, 0);
  ASSERT_TRUE(kept.room->mark(other, "of another"));
  ASSERT_TRUE(kept.room->mark(nobody, "of nobody"));
  const AuthorId again = kept.room->join(MemberKind::watcher, 1);
  ASSERT_TRUE(kept.room->mark(again, "later"));
  Cut bad = kept.cuts.at(kept.room->decided(kept.hand));
  bad.lease_epoch = kept.room->lease_epoch(kept.hand);
  bad.spindle_rpm = 1'000'000;
  ASSERT_TRUE(kept.room->submit(bad));
  kept.keep();
  std::vector<std::string> lines;
  const auto take = [&](const std::string& line) {
    lines.push_back(line);
    return true;
  };
  ASSERT_TRUE(kept.store->export_person(1, take));
  ASSERT_THAT(lines, SizeIs(1 + 1 + 8 + 2 + 1));
  EXPECT_THAT(lines.front(), AllOf(HasSubstr("\"person\":1"), HasSubstr("\"label\":\"Anna \\\"A\\\"\\u000a\"")));
  EXPECT_THAT(lines[1], HasSubstr("\"join\""));
  EXPECT_THAT(lines[2], HasSubstr("\"cut\""));
  EXPECT_THAT(lines[11], HasSubstr("later"));
  EXPECT_THAT(lines[12], HasSubstr("\"rejection\""));
  for (const std::string& line : lines) EXPECT_THAT(line, ::testing::Not(HasSubstr("of another")));

  ASSERT_TRUE(kept.store->erase_person(1));
  lines.clear();
  ASSERT_TRUE(kept.store->export_person(1, take));
  EXPECT_THAT(lines, SizeIs(12)) << "its work stays, under its number";
  EXPECT_EQ(kept.store->export_person(7, take).error().code, ErrorCode::not_found);
}

// A folder with this family of rooms, among other rooms of the same names:
//   femur --+-- b1 --- b11
//           +-- b2
class FamilyTest : public RoomFilesTest {
 protected:
  void SetUp() override {
    make(kRoomFile, 1, {"b1", "b2"});
    ASSERT_TRUE(branch_journal("/rooms/b1", "/rooms/b11", RoomSeq{6}, "b11", {}, &disk_));
    make("/rooms/other", 2, {"c1"});
    disk_.put("/rooms/notes.txt", "of the day");
  }
  void make(const std::string& file, unsigned seed, const std::vector<std::string>& branches) {
    KeptCuts kept(file, &disk_, "femur", seed);
    kept.cut(6);
    kept.checkpoint();
    ASSERT_TRUE(kept.store->close());
    for (const std::string& name : branches)
      ASSERT_TRUE(branch_journal(file, "/rooms/" + name, RoomSeq{8}, name, {}, &disk_));
  }
  std::vector<std::string> branches(const fs::path& file, const HasHead& has = {}) {
    const auto found = branches_of("/rooms", file, has, &disk_);
    EXPECT_TRUE(found) << found.error().message;
    std::vector<std::string> all;
    for (const RoomFile& one : found.value()) all.push_back(one.genesis.room);
    return all;
  }
};

TEST_F(FamilyTest, BranchesAreKnownByTheHistoryThatTheyName) {
  EXPECT_THAT(branches(kRoomFile), ElementsAre("b1", "b2", "b11"));
  EXPECT_THAT(branches("/rooms/other"), ElementsAre("c1"));
  EXPECT_THAT(branches("/rooms/b1"), ElementsAre("b11"));
  EXPECT_THAT(branches("/rooms/b2"), IsEmpty());
  EXPECT_FALSE(branches_of("/rooms", "/rooms/notes.txt", {}, &disk_));
  EXPECT_TRUE(has_head(kRoomFile, first_head(to_bytes(*peek_genesis(kRoomFile, &disk_))), &disk_).value());
  EXPECT_FALSE(has_head(kRoomFile, {RoomSeq{5}, {}}, &disk_).value());
  EXPECT_FALSE(has_head(kRoomFile, {RoomSeq{5000}, {}}, &disk_).value());

  // In use, with entries that are only in its log.
  KeptCuts live(kRoomFile, &disk_, "femur");
  EXPECT_THAT(branches(kRoomFile), ElementsAre("b1", "b2", "b11"))
      << "these branches are of entries in the database file";
  live.cut(2);
  const RoomSeq newest = live.store->head().seq;
  ASSERT_TRUE(live.store->branch("/rooms/b3", newest, "b3"));
  EXPECT_EQ(branches_of("/rooms", kRoomFile, {}, &disk_).error().code, ErrorCode::exists) << "only the store can know";
  const HasHead has = [&](const fs::path& file, const JournalHead& head) {
    return file == kRoomFile ? live.store->has_head(head) : has_head(file, head, &disk_);
  };
  EXPECT_THAT(branches(kRoomFile, has), ElementsAre("b1", "b2", "b3", "b11"));
}

TEST_F(FamilyTest, DeletedWithItsBranchesNothingOfItIsLeft) {
  {
    const KeptCuts used("/rooms/b11", &disk_, "b11");
    const MemoryDisk::Image before = disk_.image();
    EXPECT_EQ(delete_room(kRoomFile, true, &disk_).error().code, ErrorCode::exists);
    EXPECT_EQ(disk_.image(), before);
  }
  const auto gone = delete_room(kRoomFile, true, &disk_);
  ASSERT_TRUE(gone) << gone.error().message;
  EXPECT_THAT(*gone, ElementsAre("/rooms/b11", "/rooms/b2", "/rooms/b1", kRoomFile));
  for (const std::string& name : names())
    EXPECT_TRUE(name.starts_with("/rooms/other") || name.starts_with("/rooms/c1") || name == "/rooms/notes.txt")
        << name;
  EXPECT_TRUE(verify_journal("/rooms/other", &disk_)->sound());
  EXPECT_TRUE(verify_journal("/rooms/c1", &disk_)->sound());
  EXPECT_EQ(delete_room(kRoomFile, true, &disk_).error().code, ErrorCode::not_found);
  const KeptCuts anew(kRoomFile, &disk_, "femur");
  EXPECT_EQ(anew.room->room_seq(), RoomSeq{1});
}

TEST_F(FamilyTest, AloneItLeavesItsBranchesWhole) {
  ASSERT_THAT(*delete_room(kRoomFile, false, &disk_), ElementsAre(kRoomFile));
  for (const char* file : {"/rooms/b1", "/rooms/b2", "/rooms/b11"})
    EXPECT_TRUE(verify_journal(file, &disk_)->sound()) << file;
  ASSERT_TRUE(delete_room("/rooms/b1", true, &disk_));
  EXPECT_FALSE(disk_.size("/rooms/b11").value());
  EXPECT_TRUE(disk_.size("/rooms/b2").value());
}

// A branch of a journal that has lost its end contains what is confirmed, if that was requested, and never less than
// what was requested.
TEST_F(RoomFilesTest, ABranchOfAllIsNotMadeOfADamagedJournal) {
  RoomSeq last;
  {
    KeptCuts kept(kRoomFile, &disk_, "femur");
    kept.keep();
    ASSERT_TRUE(kept.store->write(test::plain_entries(kept.store->head().seq, 40)));
    last = kept.store->head().seq;
    ASSERT_TRUE(kept.store->close());
  }
  const std::size_t at = disk_.image().at(kRoomFile).find("30." + std::string(20, 'x'));
  ASSERT_NE(at, std::string::npos);
  disk_.flip_bit(kRoomFile, 8 * (at + 6) + 1);
  const auto all = branch_journal(kRoomFile, "/rooms/b", {}, "b", {}, &disk_);
  ASSERT_FALSE(all);
  EXPECT_EQ(all.error().code, ErrorCode::unavailable);
  EXPECT_THAT(all.error().message,
              AllOf(HasSubstr("entry 30 does not fit the chain"), HasSubstr("--at 29 takes these")));
  EXPECT_EQ(branch_journal(kRoomFile, "/rooms/b", last, "b", {}, &disk_).error().code, ErrorCode::invalid_input);
  EXPECT_FALSE(disk_.size("/rooms/b").value());
  const auto confirmed = branch_journal(kRoomFile, "/rooms/b", RoomSeq{29}, "b", {}, &disk_);
  ASSERT_TRUE(confirmed) << confirmed.error().message;
  EXPECT_EQ(confirmed->seq, RoomSeq{29});
}

// The room is not closed, so its last entries are only in its log. The power fails at every write and sync of the
// deletion in turn.
TEST_F(RoomFilesTest, CutShortADeletionLeavesAWholeRoomOrNone) {
  RoomSeq head;
  {
    KeptCuts kept(kRoomFile, &disk_, "femur");
    kept.cut(4);
    kept.checkpoint();
    kept.cut(4);
    head = kept.store->head().seq;
    ASSERT_TRUE(kept.store->branch("/rooms/b", {}, "b"));
  }
  const MemoryDisk::Image before = disk_.image();
  int whole = 0, none = 0, cases = 0;
  // Random which unsynced data survives the power failure, so each point is tried several times.
  for (bool failed = true; failed; ++cases) {
    disk_.load(before);
    disk_.fail_power_at(static_cast<std::uint64_t>(cases / 5 + 1));
    const bool done = delete_room(kRoomFile, true, &disk_).has_value();
    failed = disk_.has_failed();
    EXPECT_EQ(done, !failed);
    disk_.power_returns();
    for (const char* file : {kRoomFile, "/rooms/b"}) {
      Result<Journal> left = Journal::open(file, {.disk = &disk_});
      if (left) {
        ++whole;
        EXPECT_EQ(left->head().seq, head) << file << " after " << cases;
        EXPECT_EQ(left->closed_because(), nullptr);
      } else {
        ++none;
        EXPECT_EQ(left.error().code, ErrorCode::not_found) << left.error().message;
      }
    }
    const auto again = delete_room(kRoomFile, true, &disk_);
    EXPECT_TRUE(again || again.error().code == ErrorCode::not_found) << again.error().message;
    EXPECT_TRUE(Journal::create(kRoomFile, "bone", {.disk = &disk_})) << "nothing prevents a new journal";
  }
  std::printf("%d places to fail at: %d journals whole, %d gone\n", cases / 5, whole, none);
  EXPECT_GT(whole, 2);
  EXPECT_GT(none, 2);
}

}  // namespace
}  // namespace osteon
