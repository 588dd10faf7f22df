// The inside of a Journal, for code that checks and copies a journal in use.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/journal/journal.hpp"
#include "server/journal/journal_file.hpp"

namespace osteon {

struct Journal::State {
  std::filesystem::path path;
  JournalOptions options;
  Disk* disk;
  std::unique_ptr<DiskLock> lock;  // released last
  JournalFile file;
  FileIdentity identity;  // of the file
  JournalHead head = {};
  std::optional<MirroredLog> log = {};  // nothing: it has accepted no entries since it was opened
  std::uint64_t generation = 0;         // of the log
  std::optional<RoomSeq> recovered_to = {};
  std::optional<Error> closed = {};
  std::vector<std::string> notes = {};               // from when it was opened
  std::optional<RoomSeq> signed_since = {};          // none: nothing is signed
  std::optional<SignedEntries> last_signature = {};  // of the newest entries, until the database has it
  bool only_read = false;
};

struct JournalInside {
  static Journal::State& of(Journal& journal) { return *journal.state_; }
  // Copies the log into the database, so that all of the journal can be read from the disk. Error: the reason why the
  // journal accepts no entries.
  static Result<void> carry(Journal& journal) {
    return journal.write([&] { return journal.carry(); });
  }
  static Result<void> write_through(Journal& journal, const std::function<Result<void>(JournalFile&)>& work) {
    return journal.write_through([&] { return work(journal.state_->file); });
  }
};

// A file that an earlier journal of this name left behind would be mistaken for one of a new journal. Error exists,
// naming it.
[[nodiscard]] Result<void> check_nothing_left(Disk& disk, const std::filesystem::path& file);
[[nodiscard]] Disk& disk_of(const JournalOptions& options);
// Locks the file itself, not a file beside it that anybody could remove. Error exists: another process has the journal.
[[nodiscard]] Result<std::unique_ptr<DiskLock>> take_lock(Disk& disk, const std::filesystem::path& file, LockKind kind);

}  // namespace osteon
