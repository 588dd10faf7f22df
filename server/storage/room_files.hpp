// Works on rooms as files of a folder: reads what a room is, branches, deletes.
#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/journal/journal.hpp"
#include "server/journal/maintenance.hpp"
#include "server/storage/journal_entries.hpp"

namespace osteon {

// Callbacks of long work. Both are called between slices, without any lock. They may wait, to reduce the load on the
// disk.
struct MaintenanceCalls {
  std::function<void(double)> progress;  // fraction done
  std::function<bool()> stop;            // true: stop the work, with the error cancelled
};

// Locks a folder of rooms for one server, as long as the server holds the result. A second server would open the rooms
// that the first one has closed, and overwrite its list of open rooms. Journals have their own locks, so other programs
// may work on journals that no server has open. Errors: exists (another server has the folder), and those of
// Disk::lock.
[[nodiscard]] Result<std::unique_ptr<DiskLock>> lock_rooms(const std::filesystem::path& folder, Disk* disk = nullptr);

// Reads how a journal's room began, even if the journal is in use. Nothing else is verified. Errors: not_found,
// invalid_input (no journal, or its beginning cannot be read before it is opened), unsupported.
[[nodiscard]] Result<RoomGenesis> peek_genesis(const std::filesystem::path& file, Disk* disk = nullptr);

// Makes a new room in `to` that begins with everything that another room was up to sequence number `seq` (null: all of
// it): entries and checkpoints. The branch has the numbers of people, but not their names. The journal must not be in
// use; for one in use see RoomStore::branch. Errors: not_found; exists (in use, or something is in `to`); invalid_input
// (no such sequence number, or damaged); unavailable (all of it was asked for, and the journal accepts no entries);
// cancelled.
[[nodiscard]] Result<JournalHead> branch_journal(const std::filesystem::path& from, const std::filesystem::path& to,
                                                 RoomSeq seq, const std::string& name,
                                                 const MaintenanceCalls& calls = {}, Disk* disk = nullptr);

// Whether this head is in the history of a journal.
using HasHead = std::function<Result<bool>(const std::filesystem::path& file, const JournalHead& head)>;

// Finds the branches of a room in a folder, and their branches, each after the one that it was made from. Compares the
// name of the room and its history, which a branch records. `has` is for rooms that are in use; null: has_head() of
// server/journal/maintenance.hpp is used. Errors: those of `has`.
struct RoomFile {
  std::filesystem::path file;
  RoomGenesis genesis;
};
[[nodiscard]] Result<std::vector<RoomFile>> branches_of(const std::filesystem::path& folder,
                                                        const std::filesystem::path& file, const HasHead& has = {},
                                                        Disk* disk = nullptr);

// Deletes a room's journal with all files beside it. With `branches`, first deletes the branches in its folder. None of
// them may be in use. Returns the journals that were deleted. Backups, and branches elsewhere, stay, since their places
// are unknown. Errors: those of delete_journals() and branches_of().
[[nodiscard]] Result<std::vector<std::filesystem::path>> delete_room(const std::filesystem::path& file, bool branches,
                                                                     Disk* disk = nullptr);

// The current name of a journal's room. Errors: those of reading it.
[[nodiscard]] Result<std::string> room_name(Journal& journal);
// Checks that the room in a journal has the name of its file. Error invalid_input: it is another room (the message has
// both names and a remedy), or its name was set without the key that the journal was opened with.
[[nodiscard]] Result<void> check_room_name(Journal& journal, const std::filesystem::path& file,
                                           const std::string& name);

// Error: the journal accepts no entries, so nobody knows whether its entries are complete. The message names `option`,
// a command-line option that takes a sequence number. Up to the number in the message the journal is confirmed.
[[nodiscard]] Result<void> check_whole(const Journal& journal, const std::string& option);

// As branch_journal(), step by step, of a journal that is in use.
[[nodiscard]] Result<JournalCopy> begin_branch(Journal& from, const std::filesystem::path& to, RoomSeq seq,
                                               const std::string& name);
// The error of work that was stopped.
[[nodiscard]] tl::unexpected<Error> given_up(const std::string& what);

}  // namespace osteon
