// The inside of a Journal, for what checks and copies one while it is in use.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>

#include "server/journal/journal.hpp"
#include "server/journal/journal_file.hpp"

namespace osteon {

struct Journal::State {
  std::filesystem::path path;
  JournalOptions options;
  Disk* disk;
  std::unique_ptr<DiskLock> lock;  // let go last
  JournalFile file;
  JournalHead head;
  std::optional<RoomSeq> recovered_to;
  std::optional<Error> closed;
  std::optional<Statement> insert;
};

struct JournalInside {
  static Journal::State& of(Journal& journal) { return *journal.state_; }
};

// What an earlier journal of this name left behind would be taken for a new one's. Error exists, naming it.
[[nodiscard]] Result<void> check_nothing_left(Disk& disk, const std::filesystem::path& file);
[[nodiscard]] Disk& disk_of(const JournalOptions& options);
// Error exists: another process has the journal.
[[nodiscard]] Result<std::unique_ptr<DiskLock>> take_lock(Disk& disk, const std::filesystem::path& file);

}  // namespace osteon
