// Work on the journal of a room in use: reading, verifying, copying and branching it, and its checkpoints.
#include "server/storage/room_store.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <thread>

#include "haptic_client/prediction/confirmation_monitor.hpp"
#include "haptic_client/prediction/cut_recorder.hpp"
#include "tests/support/disk/memory_disk.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/rooms/kept_room.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using test::entries_of;
using test::KeptCuts;
using test::MemoryDisk;
using test::plain_entries;
using test::replay_of;
using test::test_block;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char *kFile = "/rooms/femur", *kTo = "/else/copy";

class RoomStoreTest : public ::testing::Test {
 protected:
  // Writes an entry at every call. If the journal were locked meanwhile, it would wait for ever.
  MaintenanceCalls writing(KeptCuts& kept, int& written) {
    return {[&kept, &written](double) {
              kept.cut(1);
              ++written;
            },
            {}};
  }
  std::size_t files_of(const std::string& path) const {
    const MemoryDisk::Image image = disk_.image();
    return static_cast<std::size_t>(
        std::ranges::count_if(image, [&](const auto& file) { return file.first.starts_with(path); }));
  }
  MemoryDisk disk_{1};
};

TEST_F(RoomStoreTest, OnceClosedItSaysSoAndTouchesNothing) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(3);
  RoomStore& store = *kept.store;
  const JournalHead head = store.head();
  ASSERT_TRUE(store.close());
  const MemoryDisk::Image before = disk_.image();
  const MemoryDisk::Counts counts = disk_.counts();
  std::vector<Error> errors;
  const auto note = [&](const auto& result) {
    ASSERT_FALSE(result);
    errors.push_back(result.error());
  };
  note(store.write(plain_entries(head.seq, 1)));
  note(store.person("Anna"));
  note(store.people());
  note(store.erase_person(1));
  note(store.erase_old_people());
  note(store.check_witness(store.witness()));
  note(store.has_head(head));
  note(store.read(RoomSeq{1}, head.seq, [](const LogEntry&) { return true; }));
  note(store.export_person(1, [](const std::string&) { return true; }));
  note(store.verify(test_block(), std::nullopt));
  note(store.backup(kTo));
  note(store.branch(kTo, {}, "branch"));
  note(store.checkpoint(head.seq, kept.room->all_leaves()));
  note(store.close());
  for (const Error& error : errors) {
    EXPECT_EQ(error.code, ErrorCode::unavailable) << error.message;
    EXPECT_THAT(error.message, HasSubstr("the room femur is closed"));
  }
  EXPECT_THAT(errors, SizeIs(14));
  EXPECT_EQ(store.head(), head);
  EXPECT_EQ(disk_.image(), before);
  EXPECT_EQ(disk_.counts().writes, counts.writes);
}

TEST_F(RoomStoreTest, BelievesWhatItSealedAndNothingElseOfWhatItLacks) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(2);
  const Witness early = kept.store->witness();
  const MemoryDisk::Image image = disk_.image();
  kept.cut(3);
  const Witness late = kept.store->witness();
  ASSERT_GT(late.head.seq, early.head.seq);
  EXPECT_TRUE(kept.store->check_witness(early));
  EXPECT_TRUE(kept.store->check_witness({early.head, {}})) << "no seal is needed for entries that the store has";
  Witness other = early;
  other.head.chain.bytes[0] ^= 1;
  EXPECT_EQ(kept.store->check_witness(other).error().code, ErrorCode::invalid_input)
      << "the witness is of another history";

  // The disk loses data that it had reported as synced.
  kept.store.reset();
  disk_.load(image);
  kept.open(kFile);
  Witness far = late;
  far.head.seq = RoomSeq{1'000'000};
  for (const Witness& lie : {Witness{late.head, {}}, Witness{late.head, early.seal}, far}) {
    const Result<void> told = kept.store->check_witness(lie);
    ASSERT_FALSE(told);
    EXPECT_EQ(told.error().code, ErrorCode::invalid_input);
    EXPECT_THAT(told.error().message, HasSubstr("start again to join it as it is now"));
  }
  kept.cut(1);
  kept.store.reset();
  disk_.load(image);
  kept.open(kFile);
  const Result<void> lost = kept.store->check_witness(late);
  EXPECT_EQ(lost.error().code, ErrorCode::unavailable);
  const std::uint64_t told = late.head.seq.value, less = told - early.head.seq.value;
  EXPECT_THAT(lost.error().message,
              HasSubstr("the room femur has lost " + std::to_string(less) + " of the " + std::to_string(told) +
                        " events that were acknowledged to you, and takes no more cuts"));
  EXPECT_EQ(kept.store->check_witness(late).error().message, lost.error().message)
      << "the next witness gets the same error";
  EXPECT_FALSE(kept.store->write(plain_entries(kept.store->head().seq, 1))) << "entries were lost: it takes no more";
  kept.store.reset();
  kept.open(kFile);
  EXPECT_FALSE(kept.store->write(plain_entries(kept.store->head().seq, 1))) << "nor when it is opened again";
}

// In whatever way the journal was damaged, the message names the journal and what is lost.
TEST_F(RoomStoreTest, SaysToWhomeverItSentMoreWhatIsLost) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(2);
  const RoomSeq copied = kept.store->head().seq;
  const MemoryDisk::Image image = disk_.image();
  kept.cut(3);
  const Witness late = kept.store->witness();
  const std::string of_all = " of the " + std::to_string(late.head.seq.value) + " events that were acknowledged to you";
  const std::string lost = "the room femur has lost " + std::to_string(late.head.seq.value - copied.value) + of_all;
  const auto told = [&](const fs::path& file, MemoryDisk& disk) {
    KeptCuts room(file, &disk, "femur", 2);  // With other cuts.
    const auto say = [&] {
      const Result<void> checked = room.store->check_witness(late);
      return checked ? std::string("nothing") : checked.error().message;
    };
    const std::string at_once = say();
    room.cut(20);  // It goes on beyond the acknowledged entry.
    return std::pair(at_once, say());
  };
  kept.store.reset();

  MemoryDisk other{2};
  const auto anew = told(kFile, other);
  const std::string none = "the room femur begins anew: its journal has none" + of_all;
  EXPECT_THAT(anew.first, HasSubstr(none));
  EXPECT_THAT(anew.second, HasSubstr(none));

  disk_.load(image);
  const fs::path aside = "/aside/femur";
  ASSERT_TRUE(salvage_journal(kFile, aside, &disk_));
  const auto recovered = told(aside, disk_);
  const std::string up_to = lost + ": its journal was salvaged up to event " + std::to_string(copied.value);
  EXPECT_THAT(recovered.first, HasSubstr(up_to));
  EXPECT_THAT(recovered.second, HasSubstr(up_to));

  disk_.load(image);
  KeptCuts copy(kFile, &disk_, "femur");
  copy.cut(20);
  EXPECT_THAT(copy.store->check_witness(late).error().message,
              HasSubstr("the room femur has lost some" + of_all + ": an older copy of its journal has gone on"));
  EXPECT_EQ(copy.store->closed_to_entries(), nullptr) << "the salvaged journal may go on";
}

TEST_F(RoomStoreTest, TimeAdvancesByMoreThanClientsWorkUnacknowledged) {
  // The most that a client may have done since the last entry: it cuts until it has received nothing for this time, or
  // until this many cuts are unacknowledged.
  constexpr double kTick_s = 0.001, kAway_s = std::chrono::duration<double>(kTimeAway).count();
  static_assert(kAway_s > haptic::ConfirmationMonitor::kSilence_s);
  static_assert(kAway_s > haptic::ConfirmationMonitor::kMostUnconfirmed * haptic::CutRecorder::kTicksPerCut * kTick_s);
  KeptCuts kept(kFile, &disk_, "femur");
  EXPECT_EQ(reopened_time(Room(test_block())), 0ns) << "the room is new";
  kept.cut(3);
  const auto at = kept.room->time();
  kept.store.reset();
  kept.open(kFile);
  EXPECT_EQ(kept.room->time(), at);
  EXPECT_EQ(reopened_time(*kept.room), at + kTimeAway);
}

TEST_F(RoomStoreTest, IsReadWhileItIsWritten) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(300);
  const BoneAt bone = kept.bone();
  const Digest hash = kept.room->room_hash();
  Room replayed(test_block());
  int written = 0;
  const Result<void> read = kept.store->read(RoomSeq{1}, RoomSeq{1'000'000}, [&](const LogEntry& entry) {
    EXPECT_TRUE(replayed.replay(entry));
    if (entry.seq.value % 20 == 0 && ++written) kept.cut(1);
    return true;
  });
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(replayed.room_seq(), bone.seq) << "the head as it was when the reading began";
  EXPECT_EQ(replayed.room_hash(), hash);
  EXPECT_GT(written, 30);
  EXPECT_GT(kept.store->head().seq, bone.seq);

  std::vector<std::uint64_t> seqs;
  const auto note = [&](const LogEntry& entry) {
    seqs.push_back(entry.seq.value);
    return seqs.size() < 4;
  };
  ASSERT_TRUE(kept.store->read(RoomSeq{257}, RoomSeq{259}, note));
  EXPECT_THAT(seqs, ::testing::ElementsAre(257, 258, 259));
  seqs.clear();
  ASSERT_TRUE(kept.store->read(RoomSeq{}, RoomSeq{600}, note));
  EXPECT_THAT(seqs, ::testing::ElementsAre(1, 2, 3, 4)) << "until it was told to stop";
  seqs.clear();
  ASSERT_TRUE(kept.store->read(RoomSeq{10'000}, RoomSeq{20'000}, note));
  EXPECT_THAT(seqs, IsEmpty());
}

TEST_F(RoomStoreTest, AVerifyConfirmsLogEntriesCheckpointsAndBone) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(30);
  kept.checkpoint();
  kept.cut(30);
  kept.checkpoint();
  kept.cut(30);
  const BoneAt live = kept.bone();
  kept.cut(5);
  const JournalHead head = kept.store->head();
  int written = 0;
  const Result<RoomReport> report = kept.store->verify(test_block(), live, writing(kept, written));
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_THAT(report->faults, IsEmpty());
  EXPECT_TRUE(report->sound());
  EXPECT_EQ(report->head, head);
  EXPECT_EQ(report->first_bad, std::nullopt);
  EXPECT_EQ(report->checkpoints, 2u);
  EXPECT_EQ(report->replayed.seq, live.seq);
  EXPECT_EQ(report->replayed.field_hash, live.field_hash);
  EXPECT_GT(written, 1);
  EXPECT_GT(kept.store->head().seq, head.seq);

  const Result<RoomReport> entries_only = kept.store->verify(test_block(), std::nullopt);
  ASSERT_TRUE(entries_only);
  EXPECT_TRUE(entries_only->sound());
  EXPECT_EQ(entries_only->replayed.seq, RoomSeq{});
  EXPECT_EQ(entries_only->head, kept.store->head());

  BoneAt other = live;
  other.field_hash.bytes[0] ^= 1;
  const Result<RoomReport> wrong = kept.store->verify(test_block(), other);
  ASSERT_TRUE(wrong);
  ASSERT_THAT(wrong->faults, SizeIs(1));
  EXPECT_THAT(wrong->faults[0], HasSubstr("make another bone"));

  const RoomSeq later{kept.store->head().seq.value + 1};
  EXPECT_EQ(kept.store->verify(test_block(), BoneAt{later, {}}).error().code, ErrorCode::unavailable);
  const Case another = test::plain_block(24.0, 12.0, test::kBlockPitch_mm, 1.2);
  EXPECT_EQ(kept.store->verify(another, live).error().code, ErrorCode::unsupported);
  int asked = 0;
  const MaintenanceCalls stopping{{}, [&] { return ++asked == 10; }};
  EXPECT_EQ(kept.store->verify(test_block(), live, stopping).error().code, ErrorCode::cancelled);
  EXPECT_EQ(asked, 10);
}

TEST_F(RoomStoreTest, AVerifyFindsCheckpointsThatWereSpoiledOrMadeOfAnotherBone) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(10);
  const std::vector<FieldLeaf> earlier = kept.room->all_leaves();
  kept.cut(10);
  kept.checkpoint();
  const RoomSeq good = kept.room->room_seq();
  kept.cut(1);
  ASSERT_TRUE(kept.store->checkpoint(kept.room->room_seq(), earlier))
      << "it cannot know that they are of an earlier sequence number";
  Result<RoomReport> report = kept.store->verify(test_block(), kept.bone());
  ASSERT_TRUE(report);
  ASSERT_THAT(report->faults, SizeIs(1));
  EXPECT_THAT(report->faults[0],
              AllOf(HasSubstr("the checkpoint at event " + std::to_string(kept.room->room_seq().value)),
                    HasSubstr("is not what its entries make")));
  EXPECT_EQ(report->checkpoints, 2u) << "the checkpoint's bytes are as they were written";

  for (const auto& [name, bytes] : disk_.image())
    if (name.find("-" + std::to_string(good.value) + "-") != std::string::npos) disk_.flip_bit(name, 4 * bytes.size());
  report = kept.store->verify(test_block(), std::nullopt);
  ASSERT_TRUE(report);
  ASSERT_THAT(report->faults, SizeIs(1));
  EXPECT_THAT(report->faults[0], HasSubstr("is not what was written"));
  EXPECT_EQ(report->checkpoints, 1u);
  EXPECT_EQ(kept.store->backup(kTo).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(files_of("/else/"), 0u);
}

// Nobody recomputes the bone of a checkpoint before it is used.
TEST_F(RoomStoreTest, ServesTheBoneOfNoCheckpointThatItsKeyDidNotSign) {
  KeptCuts kept(kFile, &disk_, "femur");
  const auto reopen = [&](const std::shared_ptr<const SigningKeys>& keys) {
    ASSERT_TRUE(kept.store->close());
    kept.store.reset();
    kept.options.journal.keys = keys;
    kept.open(kFile);
  };
  const std::vector<FieldLeaf> uncut = kept.room->all_leaves();
  kept.cut(10);
  const Digest cut = kept.room->field_hash();
  ASSERT_TRUE(kept.store->checkpoint(kept.room->room_seq(), uncut));
  reopen(nullptr);
  ASSERT_NE(kept.room->field_hash(), cut) << "without a key the bone is accepted as the server's";
  reopen(std::make_shared<const SigningKeys>(SigningKey::make()));
  EXPECT_EQ(kept.room->field_hash(), cut);
}

// Damage on the disk, under an open journal, beyond what SQLite has in memory.
TEST_F(RoomStoreTest, DamageUnderAnOpenJournalIsFound) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.keep();
  ASSERT_TRUE(kept.store->write(plain_entries(kept.store->head().seq, 600, 20'000)));
  const JournalHead head = kept.store->head();
  const std::string bytes = disk_.image().at(kFile);
  const std::size_t at = bytes.find("100." + std::string(50, 'x'));
  ASSERT_NE(at, std::string::npos) << "what exceeds the log is in the database";
  disk_.flip_bit(kFile, 8 * (at + 20) + 1);
  const Result<RoomReport> report = kept.store->verify(test_block(), std::nullopt);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->first_bad, RoomSeq{100});
  EXPECT_EQ(report->head.seq, RoomSeq{99});
  ASSERT_FALSE(report->sound());
  EXPECT_THAT(report->faults[0], HasSubstr("entry 100 does not fit the chain of hashes"));
  std::size_t seen = 0;
  const Result<void> read = kept.store->read(RoomSeq{1}, head.seq, [&](const LogEntry&) { return ++seen > 0; });
  EXPECT_EQ(read.error().code, ErrorCode::invalid_input);
  EXPECT_EQ(seen, 99u);
  EXPECT_EQ(kept.store->backup(kTo).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(kept.store->branch(kTo, {}, "b").error().code, ErrorCode::invalid_input);
  EXPECT_EQ(files_of("/else/"), 0u);
  EXPECT_TRUE(kept.store->branch(kTo, RoomSeq{99}, "b")) << "the damage does not reach the branch";
}

// Also if SQLite still has the entries in memory since they were written.
TEST_F(RoomStoreTest, DamageUnderLogEntriesThatWereJustWrittenIsFound) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(3);
  const RoomSeq before = kept.store->head().seq;
  ASSERT_TRUE(kept.store->write(plain_entries(before, 20)));
  ASSERT_TRUE(kept.store->verify(test_block(), std::nullopt)->sound());
  const std::string entry = std::to_string(before.value + 7) + "." + std::string(20, 'x');
  const std::size_t at = disk_.image().at(kFile).rfind(entry);
  ASSERT_NE(at, std::string::npos) << "a check moves the log into the database";
  disk_.flip_bit(kFile, 8 * (at + 10) + 1);
  const Result<RoomReport> report = kept.store->verify(test_block(), std::nullopt);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->first_bad, RoomSeq{before.value + 7});
  EXPECT_FALSE(report->sound());
}

TEST_F(RoomStoreTest, AnIdleRoomsLogGoesIntoTheDatabase) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.keep();
  const auto file_bytes = [&] { return disk_.size(kFile).value().value(); };
  ASSERT_TRUE(kept.store->tidy_if_idle());
  const std::uint64_t before = file_bytes();
  ASSERT_TRUE(kept.store->write(plain_entries(kept.store->head().seq, 20, 20'000)));
  ASSERT_TRUE(kept.store->tidy_if_idle());
  EXPECT_EQ(file_bytes(), before) << "entries were added since the last request";
  ASSERT_TRUE(kept.store->tidy_if_idle());
  EXPECT_GT(file_bytes(), before + 20u * 20'000);
  ASSERT_TRUE(kept.store->write(plain_entries(kept.store->head().seq, 3)));
  EXPECT_TRUE(kept.store->verify(test_block(), std::nullopt)->sound());

  // A store that takes no entries is left alone, and does not report that every few seconds.
  disk_.fail_write_at(1, EIO);
  ASSERT_FALSE(kept.store->write(plain_entries(kept.store->head().seq, 200, 20'000)));
  const MemoryDisk::Image failed = disk_.image();
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(kept.store->tidy_if_idle());
  EXPECT_EQ(disk_.image(), failed);
}

// On the computer's disk, with locks between them: entries are written between any two slices of a check or a copy.
TEST(RoomStoreThreads, LogEntriesAreWrittenWhileAJournalIsCheckedAndCopied) {
  const test::TempDir folder;
  KeptCuts kept(folder.path() / "room", nullptr, "room");
  kept.keep();
  RoomStore& store = *kept.store;
  ASSERT_TRUE(store.write(plain_entries(store.head().seq, 20'000)));
  std::atomic<bool> end = false;
  std::atomic<std::uint64_t> written = 0;
  std::thread writer([&] {
    for (RoomSeq at = store.head().seq; !end; ++at.value, ++written) ASSERT_TRUE(store.write(plain_entries(at, 1)));
  });
  const auto wait_for_a_entry = [&](double) {
    for (const std::uint64_t before = written; written == before;) std::this_thread::yield();
  };
  for (const bool copied : {false, true}) {
    const std::uint64_t before = written;
    const JournalHead head = store.head();
    int waits = 0;
    const MaintenanceCalls calls{[&](double fraction) {
                                   if (++waits % 20 == 0) wait_for_a_entry(fraction);
                                 },
                                 {}};
    if (copied) {
      const Result<JournalHead> made = store.backup(folder.path() / "copy", calls);
      ASSERT_TRUE(made) << made.error().message;
      EXPECT_GE(made->seq, head.seq);
      EXPECT_TRUE(*store.has_head(*made));
      EXPECT_GE(waits, 20'000 / 256);
    } else {
      const Result<RoomReport> report = store.verify(test_block(), std::nullopt, calls);
      ASSERT_TRUE(report) << report.error().message;
      EXPECT_TRUE(report->sound()) << report->faults[0];
      EXPECT_GE(report->head.seq, head.seq);
    }
    EXPECT_GE(written - before, static_cast<std::uint64_t>(waits / 20));
    std::printf("%s of %llu entries: %llu entries written meanwhile, %d waited for\n", copied ? "a copy" : "a check",
                static_cast<unsigned long long>(head.seq.value), static_cast<unsigned long long>(written - before),
                waits / 20);
  }
  // Without any waits: the scheduler decides how often entries are written.
  const std::uint64_t before = written;
  ASSERT_TRUE(store.verify(test_block(), std::nullopt));
  std::printf("a check that waits for nobody: %llu entries written meanwhile\n",
              static_cast<unsigned long long>(written - before));
  end = true;
  writer.join();
  ASSERT_TRUE(store.close());
  const Result<VerifyReport> copy = verify_journal(folder.path() / "copy");
  ASSERT_TRUE(copy);
  EXPECT_TRUE(copy->sound());
}

TEST_F(RoomStoreTest, ABackupIsTheRoomAsItWasWhileItGoesOn) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(150);
  kept.checkpoint();
  kept.cut(100);
  const JournalHead head = kept.store->head();
  const Digest hash = kept.room->room_hash();
  ASSERT_EQ(kept.store->person("Anna").value(), 1u);
  int written = 0;
  const Result<JournalHead> made = kept.store->backup(kTo, writing(kept, written));
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(*made, head);
  EXPECT_GT(written, 2);
  EXPECT_GT(kept.store->head().seq, head.seq);
  const Result<VerifyReport> copy = verify_journal(kTo, &disk_);
  ASSERT_TRUE(copy);
  EXPECT_TRUE(copy->sound());
  EXPECT_EQ(copy->head, head);
  {
    const Result<PersistedRoom> again = RoomStore::open(kTo, test_block(), kept.options);
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->room.room_hash(), hash);
    EXPECT_EQ(again->store->evaluated(), head.seq.value - (1 + 150 * 2 + 30)) << "its checkpoint was copied too";
    EXPECT_THAT(again->store->people().value(), SizeIs(1));
  }
  EXPECT_EQ(kept.store->backup(kTo).error().code, ErrorCode::exists);

  int asked = 0;
  const std::size_t before = files_of("/");
  EXPECT_EQ(kept.store->backup("/else/other", {{}, [&] { return ++asked > 1; }}).error().code, ErrorCode::cancelled);
  EXPECT_EQ(files_of("/"), before);
}

// The checkpoints that the backup found when it began are gone when it reaches them.
TEST_F(RoomStoreTest, ABackupPassesOverCheckpointsThatWereReplacedMeanwhile) {
  KeptCuts kept(kFile, &disk_, "femur");
  for (int i = 0; i < 2; ++i) {
    kept.cut(20);
    kept.checkpoint();
  }
  const JournalHead head = kept.store->head();
  const Digest hash = kept.room->room_hash();
  int calls = 0;
  const MaintenanceCalls replacing{[&](double) {
                                     if (++calls > 4) return;
                                     kept.cut(1);
                                     kept.checkpoint();
                                   },
                                   {}};
  const Result<JournalHead> made = kept.store->backup(kTo, replacing);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(*made, head);
  EXPECT_GT(calls, 2);
  EXPECT_TRUE(verify_journal(kTo, &disk_)->sound());
  const Result<PersistedRoom> again = RoomStore::open(kTo, test_block(), kept.options);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->room.room_hash(), hash);
}

TEST_F(RoomStoreTest, ABackupThatWasCutShortIsNotInTheWayOfTheNext) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(150);
  std::optional<MemoryDisk::Image> half;
  const MaintenanceCalls calls{[&](double) {
                                 if (!half) half = disk_.image();
                               },
                               {}};
  (void)kept.store->backup(kTo, calls);
  ASSERT_TRUE(half && half->contains("/else/copy.copying") && half->contains("/else/copy.copying-wal"));
  kept.store.reset();
  disk_.load(*half);
  kept.open(kFile);
  const Result<JournalHead> made = kept.store->backup(kTo);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(files_of("/else/"), 1u);
}

TEST_F(RoomStoreTest, ACheckpointIsOfItsSequenceNumberThoughEntriesFollow) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(40);
  const RoomSeq seq = kept.room->room_seq();
  const std::vector<FieldLeaf> leaves = kept.room->all_leaves();
  EXPECT_EQ(kept.store->changes_since_checkpoint(), 48u) << "40 cuts, 8 undos";
  kept.cut(10);
  int written = 0;
  const Result<void> done = kept.store->checkpoint(seq, leaves, writing(kept, written));
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_GT(written, 0);
  EXPECT_EQ(kept.store->changes_since_checkpoint(), static_cast<std::uint64_t>(12 + written));
  const std::size_t files = files_of(kFile);
  ASSERT_TRUE(kept.store->checkpoint(seq, leaves)) << "there is a checkpoint already";
  ASSERT_TRUE(kept.store->checkpoint(RoomSeq{5}, leaves)) << "there is a newer checkpoint";
  ASSERT_TRUE(kept.store->checkpoint(RoomSeq{kept.store->head().seq.value + 1}, leaves))
      << "the entry is not durable yet";
  EXPECT_EQ(files_of(kFile), files);
  EXPECT_EQ(
      kept.store->checkpoint(kept.room->room_seq(), kept.room->all_leaves(), {{}, [] { return true; }}).error().code,
      ErrorCode::cancelled);
  EXPECT_EQ(files_of(kFile), files);

  const Digest hash = kept.room->room_hash();
  const RoomSeq head = kept.store->head().seq;
  ASSERT_TRUE(kept.store->verify(test_block(), kept.bone())->sound());
  kept.store.reset();  // As if the server had been killed.
  kept.open(kFile);
  EXPECT_EQ(kept.store->evaluated(), head.value - seq.value);
  EXPECT_EQ(kept.store->changes_since_checkpoint(), static_cast<std::uint64_t>(12 + written));
  EXPECT_EQ(kept.room->room_hash(), hash);
}

TEST_F(RoomStoreTest, ALargeCheckpointIsSyncedBitByBit) {
  KeptCuts kept(kFile, &disk_, "femur");
  kept.cut(1);
  std::vector<FieldLeaf> leaves;
  for (int i = 0; i < 8000; ++i) {
    leaves.push_back({BodyId{0}, 0, {8 * i, 0, 0}, std::vector<std::int16_t>(kLeafVoxels)});
    for (int k = 0; k < kLeafVoxels; ++k)
      leaves.back().values[static_cast<std::size_t>(k)] = static_cast<std::int16_t>(i * 31 + k * 7);
  }
  std::uint64_t syncs = disk_.counts().syncs, written = disk_.counts().written_bytes, most = 0, since = 0, all = 0;
  const auto look = [&](double) {
    const std::uint64_t now = disk_.counts().written_bytes - written;
    since = disk_.counts().syncs == syncs ? since + now : 0;
    syncs = disk_.counts().syncs;
    written = disk_.counts().written_bytes;
    all += now;
    most = std::max(most, since);
  };
  ASSERT_TRUE(kept.store->checkpoint(kept.room->room_seq(), leaves, {look, {}}));
  EXPECT_GT(all, 5u << 20);
  EXPECT_LE(most, 1u << 20);
  std::printf("%llu bytes, never more than %llu of them unsynced\n", static_cast<unsigned long long>(all),
              static_cast<unsigned long long>(most));
}

// Whichever comes first, no checkpoint is left half written.
TEST(RoomStoreThreads, ACheckpointThatIsBeingWrittenIsGivenUpByClosing) {
  const test::TempDir folder;
  KeptCuts kept(folder.path() / "room", nullptr, "room");
  kept.cut(5);
  std::vector<FieldLeaf> leaves;
  for (int i = 0; i < 8000; ++i)
    leaves.push_back({BodyId{0}, 0, {8 * i, 0, 0}, std::vector<std::int16_t>(kLeafVoxels, 5)});
  for (FieldLeaf& leaf : leaves) leaf.values[0] = 6;
  std::atomic<bool> begun = false, closing = false;
  Result<void> written;
  std::thread slow([&] {
    written = kept.store->checkpoint(kept.room->room_seq(), leaves,
                                     {[&](double) {
                                        begun = true;
                                        while (!closing) std::this_thread::yield();
                                      },
                                      {}});
  });
  while (!begun) std::this_thread::yield();
  closing = true;
  const Result<void> closed = kept.store->close();
  slow.join();
  EXPECT_TRUE(closed) << closed.error().message;
  EXPECT_TRUE(written || written.error().code == ErrorCode::cancelled) << written.error().message;
  std::printf("the checkpoint was %s\n", written ? "finished" : "given up");
  for (const auto& file : fs::directory_iterator(folder.path()))
    EXPECT_FALSE(file.path().string().ends_with(kPartial)) << file.path();
  const Result<VerifyReport> report = verify_journal(folder.path() / "room");
  ASSERT_TRUE(report);
  EXPECT_TRUE(report->sound());
  EXPECT_TRUE(report->closed_cleanly);
}

TEST(CheckpointPolicyTest, AsksForWorkAndForTime) {
  const CheckpointPolicy policy;
  EXPECT_TRUE(policy.is_due(2000, 60s));
  EXPECT_FALSE(policy.is_due(1999, 1h));
  EXPECT_FALSE(policy.is_due(1'000'000, 59s));
}

// The branch shares the entries of its parent. Everything else is its own.
TEST_F(RoomStoreTest, ABranchIsARoomOfItsOwn) {
  KeptCuts kept(kFile, &disk_, "femur");
  ASSERT_EQ(kept.store->person("Anna").value(), 1u);
  ASSERT_EQ(kept.store->person("Bela").value(), 2u);
  kept.cut(200);
  kept.checkpoint();
  kept.cut(10);
  const RoomSeq seq{1 + 440 + 5};
  const std::vector<LogEntry> before = entries_of(*kept.store, seq);
  const Room expected = replay_of(before);
  int written = 0;
  const Result<JournalHead> live = kept.store->branch("/else/live", seq, "second try", writing(kept, written));
  ASSERT_TRUE(live) << live.error().message;
  EXPECT_GT(written, 1);
  const Result<RoomGenesis> peeked = peek_genesis("/else/live", &disk_);
  ASSERT_TRUE(peeked);
  EXPECT_EQ(peeked->room, "second try");
  EXPECT_EQ(peeked->parent, "femur");
  EXPECT_EQ(peeked->parent_room_seq, seq);
  EXPECT_TRUE(kept.store->has_head({seq, peeked->parent_chain}).value());
  EXPECT_EQ(kept.store->branch("/else/live", seq, "second try").error().code, ErrorCode::exists);
  const RoomSeq beyond{kept.store->head().seq.value + 1};
  EXPECT_EQ(kept.store->branch("/else/beyond", beyond, "b").error().code, ErrorCode::invalid_input);
  EXPECT_EQ(branch_journal(kFile, "/else/file", seq, "b", {}, &disk_).error().code, ErrorCode::exists)
      << "the journal is in use";

  ASSERT_TRUE(kept.store->close());
  const Result<JournalHead> from_file = branch_journal(kFile, "/else/file", seq, "second try", {}, &disk_);
  ASSERT_TRUE(from_file) << from_file.error().message;
  EXPECT_EQ(*from_file, *live) << "both ways make the same branch";
  EXPECT_TRUE(verify_journal(kFile, &disk_)->closed_cleanly);
  for (const char* file : {"/else/live", "/else/file"}) {
    EXPECT_TRUE(verify_journal(file, &disk_)->sound());
    RoomStore::Options of_branch = kept.options;
    of_branch.name = "second try";
    const Result<PersistedRoom> branch = RoomStore::open(file, test_block(), of_branch);
    ASSERT_TRUE(branch) << branch.error().message;
    EXPECT_EQ(branch->room.room_hash(), expected.room_hash());
    EXPECT_EQ(branch->store->head(), *live);
    EXPECT_EQ(branch->store->evaluated(), 5u) << "the checkpoint of the parent is used";
    EXPECT_EQ(branch->store->server_epoch(), 1u);
    EXPECT_THAT(branch->store->people().value(), IsEmpty());
    EXPECT_EQ(branch->store->person("Cora").value(), 3u) << "1 and 2 are other people in its entries";
  }
  const Result<JournalHead> whole = branch_journal(kFile, "/else/whole", {}, "all", {}, &disk_);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->seq, kept.store->head().seq);
  int asked = 0;
  const std::size_t files = files_of("/");
  EXPECT_EQ(branch_journal(kFile, "/else/no", {}, "no", {{}, [&] { return ++asked > 1; }}, &disk_).error().code,
            ErrorCode::cancelled);
  EXPECT_EQ(files_of("/"), files);
}

}  // namespace
}  // namespace osteon
