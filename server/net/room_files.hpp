// What is done to rooms as files of a folder: looking into one, branching, deleting.
#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/journal/journal.hpp"
#include "server/journal/maintenance.hpp"
#include "server/net/journal_entries.hpp"

namespace osteon {

// For what takes long. Both are called between slices, without any lock, and may wait, so that less is asked of the
// disk.
struct MaintenanceCalls {
  std::function<void(double)> progress;  // fraction that is done
  std::function<bool()> stop;            // true: give up, with the error cancelled
};

// A folder of rooms for one server alone, as long as it holds what this gives: another one would open the rooms that it
// has closed, and write its list of those that are open. Journals have locks of their own, so that what is done to
// those that no server has open goes on beside it. Errors: exists (another server has the folder), and those of
// Disk::lock.
[[nodiscard]] Result<std::unique_ptr<DiskLock>> lock_rooms(const std::filesystem::path& folder, Disk* disk = nullptr);

// What a journal began as, also of one in use: nothing is confirmed but this. Errors: not_found, invalid_input (no
// journal, or what it began as cannot be read before it is opened), unsupported.
[[nodiscard]] Result<RoomGenesis> peek_genesis(const std::filesystem::path& file, Disk* disk = nullptr);

// A room of its own, in `to`, that begins with all that another one was up to a place, null for all of it: entries and
// checkpoints. It knows numbers of people, not who they are. The journal must not be in use: else RoomStore::branch.
// Errors: not_found; exists (in use, or there is something in `to`); invalid_input (no such place, damaged);
// unavailable (all of it, and it is closed to entries); cancelled.
[[nodiscard]] Result<JournalHead> branch_journal(const std::filesystem::path& from, const std::filesystem::path& to,
                                                 RoomSeq place, const std::string& name,
                                                 const MaintenanceCalls& calls = {}, Disk* disk = nullptr);

// Whether a journal has this head in its history.
using HasHead = std::function<Result<bool>(const std::filesystem::path& file, const JournalHead& head)>;

// The branches of a room among the files of a folder, and the branches of those, each after the one that it was made
// from: by the name of the room and by its history, which the branch names. `has_head`: for rooms that are in use;
// null: has_head() of server/journal/maintenance.hpp. Errors: those of it.
struct RoomFile {
  std::filesystem::path file;
  RoomGenesis genesis;
};
[[nodiscard]] Result<std::vector<RoomFile>> branches_of(const std::filesystem::path& folder,
                                                        const std::filesystem::path& file, const HasHead& has = {},
                                                        Disk* disk = nullptr);

// Removes a room's journal with all that is beside it, and where `branches`, before it the branches in its folder: none
// of them may be in use. Gives the journals that were there. Backups, and branches elsewhere, stay: nobody can know
// where they are. Errors: those of delete_journals() and branches_of().
[[nodiscard]] Result<std::vector<std::filesystem::path>> delete_room(const std::filesystem::path& file, bool branches,
                                                                     Disk* disk = nullptr);

// The name that a journal's room has now. Errors: those of reading it.
[[nodiscard]] Result<std::string> room_name(Journal& journal);
// Holds the room in a journal against the name that its file has. Error invalid_input: it is another room's, with both
// names and what to do; or its name was given without the key that the journal was opened with.
[[nodiscard]] Result<void> check_room_name(Journal& journal, const std::filesystem::path& file,
                                           const std::string& name);

// Error: the journal is closed to entries, so that nobody can say that these are all it had. `option` is how a place is
// asked for instead, up to which it is confirmed.
[[nodiscard]] Result<void> check_whole(const Journal& journal, const std::string& option);

// As branch_journal(), of a journal that somebody uses, step by step.
[[nodiscard]] Result<JournalCopy> begin_branch(Journal& from, const std::filesystem::path& to, RoomSeq place,
                                               const std::string& name);
// Why something was given up.
[[nodiscard]] tl::unexpected<Error> given_up(const std::string& what);

}  // namespace osteon
