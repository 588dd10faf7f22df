// What is done to rooms as files of a folder: looking into one, branching, deleting.
#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "server/journal/journal.hpp"
#include "server/journal/upkeep.hpp"
#include "server/net/journal_rows.hpp"

namespace osteon {

// For what takes long. Both are called between slices, without any lock, and may wait, so that less is asked of the disk.
struct UpkeepCalls {
  std::function<void(double)> progress;  // fraction that is done
  std::function<bool()> stop;            // true: give up, with the error cancelled
};

// What a journal began as, also of one in use: nothing is confirmed but this. Errors: not_found, invalid_input (no journal,
// or what it began as cannot be read before it is opened), unsupported.
[[nodiscard]] Result<RoomGenesis> peek_genesis(const std::filesystem::path& file, Disk* disk = nullptr);

// A room of its own, in `to`, that begins with all that another one was up to a place, null for all of it: rows and
// checkpoints. It knows numbers of people, not who they are. The journal must not be in use: else RoomKeeper::branch. Errors:
// not_found; exists (in use, or there is something in `to`); invalid_input (no such place, damaged); cancelled.
[[nodiscard]] Result<JournalHead> branch_journal(const std::filesystem::path& from, const std::filesystem::path& to, RoomSeq place,
                                                 const std::string& name, const UpkeepCalls& calls = {}, Disk* disk = nullptr);

// The same of a journal that somebody uses, step by step.
[[nodiscard]] Result<JournalCopy> begin_branch(Journal& from, const std::filesystem::path& to, RoomSeq place,
                                               const std::string& name);
// Why something was given up.
[[nodiscard]] tl::unexpected<Error> given_up(const std::string& what);

}  // namespace osteon
