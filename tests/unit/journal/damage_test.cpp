// A journal that was damaged anywhere: each byte of each of its files flipped, each file cut at every length, by day a
// third of them. A reader then gets exactly what was acknowledged, or an error.
#include <gtest/gtest.h>

#include <cstdio>

#include "server/journal/maintenance.hpp"
#include "tests/support/disk/journal_trials.hpp"
#include "tests/support/disk/memory_disk.hpp"
#include "tests/support/trials.hpp"
#include "tests/unit/journal/entries.hpp"

namespace osteon {
namespace {

using test::MemoryDisk;
using test::plain_head;

constexpr std::uint64_t kLogBytes = 3000;

// From one damaged place to the next. By day each field of three bytes or more is still damaged.
std::size_t stride() { return test::trials(1, 3); }

struct Outcomes {
  int whole = 0;    // as if there were no damage
  int closed = 0;   // opened only for reading, with the reason
  int refused = 0;  // not opened
  int behind = 0;   // shorter, detected by a client that had more acknowledged
  int found = 0;    // detected by verify_journal
};

class DamageTest : public ::testing::TestWithParam<bool> {
 protected:
  // Small pages keep the journal small. `closed`: with a footer and without a log. Otherwise all but the first entries
  // are in the log.
  void SetUp() override {
    Journal journal =
        std::move(Journal::create(kFile, "bone", {.disk = &disk_, .log_bytes = kLogBytes, .page_bytes = 512}).value());
    append(journal, entries_, 0, 8);
    ASSERT_TRUE(journal.set_person({"p1", "Anna", 20000}));
    ASSERT_TRUE(journal.next_server_epoch());
    auto file = journal.begin_checkpoint(journal.head(), "meta");
    ASSERT_TRUE(file && file->write("the room at place 8") && file->finish());
    ASSERT_TRUE(journal.add_checkpoint(std::move(*file)));
    ASSERT_TRUE(journal.close());
    journal = std::move(Journal::open(kFile, {.disk = &disk_, .log_bytes = kLogBytes}).value());
    append(journal, entries_, 8, 10);
    append(journal, entries_, 10, 11);
    append(journal, entries_, 11, 12);
    if (GetParam()) {
      ASSERT_TRUE(journal.close());
    }
  }
  void TearDown() override {
    std::printf("%s: %d whole, %d closed to entries, %d refused, %d behind a client; verify found %d\n",
                GetParam() ? "closed" : "killed", outcomes_.whole, outcomes_.closed, outcomes_.refused,
                outcomes_.behind, outcomes_.found);
    EXPECT_GT(outcomes_.whole, 0);
    EXPECT_GT(outcomes_.closed, 0);
    EXPECT_GT(outcomes_.refused, 0);
    EXPECT_GT(outcomes_.found, 0);
    EXPECT_EQ(outcomes_.behind, 0) << "the two logs have all acknowledged entries twice";
  }

  void look(const std::string& what) {
    SCOPED_TRACE(what);
    const MemoryDisk::Image damaged = disk_.image();
    const auto report = verify_journal(kFile, &disk_);
    if (!report || !report->sound()) ++outcomes_.found;
    ASSERT_EQ(disk_.image(), damaged) << "verifying must change nothing";

    auto opened = Journal::open(kFile, {.disk = &disk_, .log_bytes = kLogBytes});
    if (!opened) {
      ++outcomes_.refused;
      ASSERT_NE(opened.error().message.find(kFile), std::string::npos) << opened.error().message;
      ASSERT_FALSE(report && report->sound());
      return;
    }
    // Entries may be missing at the end, but never differ.
    const std::vector<JournalEntry> entries = entries_of(*opened);
    ASSERT_LE(entries.size(), entries_.size());
    ASSERT_TRUE(equal(entries, {entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(entries.size())}));
    if (opened->closed_because() != nullptr) {
      ++outcomes_.closed;
      ASSERT_FALSE(report && report->sound());
      return;
    }
    if (entries.size() < entries_.size()) {
      ++outcomes_.behind;
      ASSERT_EQ(opened->check_witness(head_).error().code, ErrorCode::unavailable);
      ASSERT_NE(opened->closed_because(), nullptr);
      return;
    }
    ++outcomes_.whole;
    ASSERT_EQ(opened->head(), head_);
    ASSERT_TRUE(opened->check_witness(head_));
    ASSERT_EQ(opened->people().value(), (std::vector<Person>{{"p1", "Anna", 20000}}));
    const std::vector<Checkpoint> checkpoints = opened->checkpoints().value();
    for (const Checkpoint& checkpoint : checkpoints) {
      ASSERT_EQ(checkpoint.at, plain_head("bone", {entries_.begin(), entries_.begin() + 8}));
      ASSERT_EQ(checkpoint.meta, "meta");
      if (const auto bytes = opened->read_checkpoint(checkpoint)) {
        ASSERT_EQ(*bytes, "the room at place 8");
      }
    }
    ASSERT_EQ(opened->next_server_epoch().value(), 2u);
    const JournalEntry next{RoomSeq{13}, 0, "next"};
    ASSERT_TRUE(opened->append({&next, 1}));
  }

  MemoryDisk disk_{1, 512};
  std::vector<JournalEntry> entries_ = some_entries(20, 12, 60);
  JournalHead head_ = plain_head("bone", entries_);
  Outcomes outcomes_;
};

TEST_P(DamageTest, FlippedAtAnyByteItIsWholeOrSaysSo) {
  const MemoryDisk::Image sound = disk_.image();
  std::mt19937_64 random(1);
  for (const auto& [name, bytes] : sound)
    for (std::size_t at = 0; at < bytes.size(); at += stride()) {
      disk_.load(sound);
      const std::uint64_t bit = random() % 8;
      disk_.flip_bit(name, 8 * at + bit);
      look(name + ", byte " + std::to_string(at) + ", bit " + std::to_string(bit));
      if (HasFatalFailure()) return;
    }
}

TEST_P(DamageTest, CutAtAnyLengthItIsWholeOrSaysSo) {
  const MemoryDisk::Image sound = disk_.image();
  for (const auto& [name, bytes] : sound)
    for (std::size_t size = 0; size < bytes.size(); size += stride() * (bytes.size() > 4096 ? 7 : 1)) {
      disk_.load(sound);
      disk_.cut(name, size);
      look(name + " cut to " + std::to_string(size));
      if (HasFatalFailure()) return;
    }
}

INSTANTIATE_TEST_SUITE_P(Journal, DamageTest, ::testing::Values(true, false),
                         [](const auto& about) { return about.param ? "Closed" : "Killed"; });

}  // namespace
}  // namespace osteon
