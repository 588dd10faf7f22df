// A real process that appends to a journal on the real disk, and is killed at any moment.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <random>
#include <sstream>
#include <thread>

#include "server/journal/maintenance.hpp"
#include "tests/support/disk/journal_trials.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/journal/kill_entries.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

constexpr int kKills = 100, kDamages = 80;
constexpr int kKillsPerJournal = 20;

// The sequence number in the last whole line that it printed.
std::uint64_t last_place(const std::string& out) {
  const std::size_t end = out.rfind('\n');
  if (end == std::string::npos) return 0;
  const std::size_t begin = end == 0 ? std::string::npos : out.rfind('\n', end - 1);
  return std::stoull(out.substr(begin == std::string::npos ? 0 : begin + 1));
}

TEST(JournalKill, LosesNoAcknowledgedEntryAndLetsTheNextOneIn) {
  std::mt19937_64 random(1);
  std::uint64_t acknowledged = 0, kept = 0;
  for (int round = 0; round < kKills / kKillsPerJournal; ++round) {
    const test::TempDir folder;
    const std::filesystem::path file = folder / "journal";
    std::uint64_t before = 0;
    for (int kill = 0; kill < kKillsPerJournal; ++kill) {
      test::Process writer(test::program("journal_kill_writer"), {file.string(), std::to_string(random())});
      // At any time: while the journal is created or opened, or later.
      const auto lines = kill % 4 == 0 ? 0 : random() % 12;
      for (std::uint64_t i = 0; i < lines; ++i) ASSERT_TRUE(writer.read_line(60s)) << writer.err();
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 8000));
      ASSERT_TRUE(writer.running()) << writer.err();
      writer.signal(SIGKILL);
      ASSERT_EQ(writer.wait(60s), 128 + SIGKILL);
      const std::uint64_t told = std::max(before, last_place(writer.out()));
      acknowledged += told - before;

      if (!std::filesystem::exists(file)) {
        ASSERT_EQ(told, 0u);
        continue;
      }
      auto journal = Journal::open(file);
      ASSERT_TRUE(journal) << journal.error().message;
      ASSERT_EQ(journal->closed_because(), nullptr) << journal->closed_because()->message;
      std::vector<JournalEntry> entries;
      ASSERT_TRUE(journal->read(RoomSeq{1}, [&](const JournalEntry& entry) {
        entries.push_back(entry);
        return true;
      }));
      ASSERT_GE(entries.size(), told);
      ASSERT_LE(entries.size(), told + 4) << "more entries than the batch under way";
      for (std::size_t i = 0; i < entries.size(); ++i) {
        const JournalEntry expected = kill_entry(i + 1);
        ASSERT_EQ(entries[i].seq, expected.seq);
        ASSERT_EQ(entries[i].at_ns, expected.at_ns);
        ASSERT_EQ(entries[i].bytes, expected.bytes);
      }
      ASSERT_EQ(journal->head(), test::plain_head("bone", entries));
      for (const Checkpoint& checkpoint : journal->checkpoints().value_or(std::vector<Checkpoint>{}))
        ASSERT_TRUE(journal->read_checkpoint(checkpoint));
      kept += entries.size() - told;
      before = entries.size();
    }
  }
  std::printf("%d kills, %lu entries acknowledged, %lu found, 0 lost\n", kKills, acknowledged, acknowledged + kept);
  EXPECT_GT(acknowledged, 5u * kKills);
}

// Damages one file in a way chosen by `random`. Returns a description.
std::string damage(const std::filesystem::path& file, std::mt19937_64& random) {
  std::string bytes;
  {
    std::ostringstream all;
    all << std::ifstream(file, std::ios::binary).rdbuf();
    bytes = std::move(all).str();
  }
  const std::size_t at = bytes.empty() ? 0 : random() % bytes.size();
  const std::size_t count = std::min<std::size_t>(1 + random() % 5000, bytes.size() - at);
  std::string done;
  switch (random() % 5) {
    case 0:
      if (!bytes.empty()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
      done = "flip";
      break;
    case 1:
      bytes.replace(at, count, std::string(count, '\0')), done = "zero";
      break;
    case 2:
      bytes.resize(at), done = "truncate";
      break;
    case 3:
      bytes.replace(at, count, bytes.substr(random() % (bytes.size() - count + 1), count)), done = "duplicate";
      break;
    default:
      std::filesystem::remove(file);
      return "delete";
  }
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
  return done;
}

// The output of the killed process says what must be in the journal.
TEST(JournalKill, DamageAfterItIsHarmlessOrNamed) {
  std::mt19937_64 random(2);
  int whole = 0, named = 0, refused = 0;
  for (int trial = 0; trial < kDamages; ++trial) {
    const test::TempDir folder;
    const std::filesystem::path file = folder / "journal";
    test::Process writer(test::program("journal_kill_writer"), {file.string(), std::to_string(random())});
    for (std::uint64_t i = 1 + random() % 40; i > 0; --i) ASSERT_TRUE(writer.read_line(60s)) << writer.err();
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 2000));
    writer.signal(SIGKILL);
    ASSERT_EQ(writer.wait(60s), 128 + SIGKILL);
    const std::uint64_t told = last_place(writer.out());

    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) files.push_back(entry.path());
    std::ranges::sort(files);
    const std::filesystem::path chosen = files[random() % files.size()];
    SCOPED_TRACE(damage(chosen, random) + " " + chosen.filename().string());
    const auto report = verify_journal(file);
    const auto journal = Journal::open(file);
    if (!journal) {
      ++refused;
      ASSERT_FALSE(report && report->sound());
    } else if (journal->closed_because() != nullptr) {
      ++named;
      ASSERT_FALSE(report && report->sound());
    } else {
      ++whole;
      ASSERT_GE(journal->head().seq.value, told);
    }
  }
  std::printf("%d damages: %d harmless, %d named, %d refused, 0 silent\n", kDamages, whole, named, refused);
  EXPECT_GT(whole, kDamages / 4);
  EXPECT_GT(named + refused, kDamages / 20);
}

// In one test: the holder of a journal is first alive, then killed.
TEST(JournalKill, TheLockEndsWithItsHolder) {
  const test::TempDir folder;
  const std::filesystem::path file = folder / "journal";
  test::Process writer(test::program("journal_kill_writer"), {file.string(), "1"});
  ASSERT_TRUE(writer.read_line(60s)) << writer.err();
  const auto second = Journal::open(file);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().message, file.string() + " is in use by another process; close the room there first");
  writer.signal(SIGKILL);
  ASSERT_TRUE(writer.wait(60s));
  EXPECT_TRUE(Journal::open(file));
}

}  // namespace
}  // namespace osteon
