#include <algorithm>
#include <array>
#include <memory>
#include <string>

#include "common/core/check.hpp"
#include "server/journal/maintenance.hpp"
#include "tests/fuzz/journal_target.hpp"
#include "tests/support/disk/memory_disk.hpp"

namespace osteon::fuzz {
namespace {

using test::MemoryDisk;

constexpr const char* kFile = "/room/journal";
constexpr const char* kRecovered = "/room/recovered";
constexpr const char* kGenesis = "bone";
constexpr std::size_t kEntries = 9;

const std::vector<JournalEntry>& all_entries() {
  static const std::vector<JournalEntry> made = [] {
    std::vector<JournalEntry> entries;
    for (std::uint64_t i = 1; i <= kEntries; ++i)
      entries.push_back(
          {RoomSeq{i}, static_cast<std::int64_t>(i) * 8'000'000, std::string(7 * i, static_cast<char>('a' + i))});
    return entries;
  }();
  return made;
}

void append(Journal& journal, std::size_t from, std::size_t to) {
  OSTEON_CHECK(journal.append(std::span(all_entries()).subspan(from, to - from)).has_value());
}

// A journal with a checkpoint. If not `closed`, its last entries are still in SQLite's log. Small pages keep it small.
MemoryDisk::Image a_journal(bool closed) {
  MemoryDisk disk(1, 512);
  Journal journal =
      std::move(Journal::create(kFile, kGenesis, {.disk = &disk, .log_bytes = 2000, .page_bytes = 512}).value());
  append(journal, 0, 6);
  auto file = journal.begin_checkpoint(journal.head(), "meta");
  OSTEON_CHECK(file && file->write("the room at place 6") && file->finish() &&
               journal.add_checkpoint(std::move(*file)));
  OSTEON_CHECK(journal.close().has_value());
  journal = std::move(Journal::open(kFile, {.disk = &disk, .log_bytes = 2000}).value());
  append(journal, 6, 8);
  append(journal, 8, kEntries);
  if (closed) OSTEON_CHECK(journal.close().has_value());
  return disk.image();
}

const MemoryDisk::Image& sound(bool closed) {
  static const std::array<MemoryDisk::Image, 2> made{a_journal(false), a_journal(true)};
  return made[closed];
}

// The first byte of an input selects the journal. Then five bytes describe each damage: file and kind, position (two
// bytes), length, and value.
// Positions wrap round the file's end, so that every damage hits the file.
void damage(MemoryDisk::Image& image, std::span<const std::uint8_t> what) {
  const auto file = std::next(image.begin(), what[0] % static_cast<std::ptrdiff_t>(image.size()));
  std::string& bytes = file->second;
  if (bytes.empty()) return;
  const std::size_t at = (what[1] | std::size_t{what[2]} << 8) % bytes.size();
  const std::size_t count = std::min<std::size_t>(what[3], bytes.size() - at);
  switch (what[0] / 16 % 6) {
    case 0:
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << what[4] % 8));
      break;
    case 1:
      bytes[at] = static_cast<char>(what[4]);
      break;
    case 2:
      bytes.resize(at);
      break;
    case 3:
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), count, static_cast<char>(what[4]));
      break;
    case 4:
      bytes.replace(at, count, bytes.substr(what[4] * std::size_t{64} % bytes.size(), count));
      break;
    default:
      image.erase(file);
      break;
  }
}

// The journal must hold what was written, up to some entry.
void expect_prefix(Journal& journal) {
  std::size_t entries = 0;
  const Result<void> read = journal.read(RoomSeq{1}, [&](const JournalEntry& entry) {
    OSTEON_CHECK(entries < kEntries);
    const JournalEntry& written = all_entries()[entries++];
    OSTEON_CHECK(entry.seq == written.seq && entry.at_ns == written.at_ns && entry.bytes == written.bytes);
    return true;
  });
  OSTEON_CHECK(!read || entries == journal.head().seq.value);
}

void open_any_journal(std::span<const std::uint8_t> data) {
  constexpr std::size_t kDamage = 5, kMost = 64;
  if (data.empty()) return;
  static MemoryDisk disk(1, 512);
  MemoryDisk::Image image = sound(data[0] & 1);
  const auto damages = data.subspan(1);
  for (std::size_t i = 0; i + kDamage <= damages.size() && i < kMost * kDamage && !image.empty(); i += kDamage)
    damage(image, damages.subspan(i, kDamage));
  disk.load(image);

  const Result<VerifyReport> report = verify_journal(kFile, &disk);
  const bool is_sound = report && report->sound();
  OSTEON_CHECK(disk.image() == image);
  const Result<RecoverReport> recovered = salvage_journal(kFile, kRecovered, &disk);
  if (recovered) {
    OSTEON_CHECK(recovered->head.seq.value <= kEntries && (!is_sound || recovered->lost() == 0));
    const Result<VerifyReport> now = verify_journal(kRecovered, &disk);
    OSTEON_CHECK(now && now->sound());
    Result<Journal> journal = Journal::open(kRecovered, {.disk = &disk, .log_bytes = 2000});
    OSTEON_CHECK(journal && journal->closed_because() == nullptr && journal->head() == recovered->head);
    expect_prefix(*journal);
  }
  disk.load(image);
  if (Result<Journal> journal = Journal::open(kFile, {.disk = &disk, .log_bytes = 2000})) {
    OSTEON_CHECK(report && (journal->closed_because() == nullptr || !is_sound));
    expect_prefix(*journal);
  } else {
    OSTEON_CHECK(!is_sound);
  }
}

}  // namespace

Target journal_file_target() {
  return {"journal_file",
          open_any_journal,
          {{0}, {1, 0, 40, 2, 0, 3}, {0, 33, 0, 9, 0, 0, 18, 0, 1, 0, 7}, {1, 48, 200, 4, 99, 0}},
          500};
}

}  // namespace osteon::fuzz
