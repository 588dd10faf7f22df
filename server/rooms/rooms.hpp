// The rooms of one server process. Makes, opens, closes, branches, replays, checks, copies and deletes them by name.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/core/result.hpp"
#include "common/tools/tool_box.hpp"
#include "server/audit/audit_trail.hpp"
#include "server/auth/refusals.hpp"
#include "server/rooms/demonstration.hpp"
#include "server/rooms/job_thread.hpp"
#include "server/rooms/room_runtime.hpp"
#include "server/storage/case_cache.hpp"
#include "server/storage/room_files.hpp"
#include "server/storage/room_store.hpp"
#include "server/upload_validation/case_repository.hpp"

namespace osteon {

struct Caller;

class Authorizer;

struct RoomSummary {
  Digest case_hash;
  BoneStatus bone;
  RuntimeHealth health;
  // Where the receiver of the summary shall write `fields`. Empty: nowhere, and `fields` are empty.
  std::filesystem::path save;
  SavedFields fields;
  Digest surface_hash;  // equal to that of every viewer that has shown room_seq
};

// Defaults.
inline constexpr int kMostRooms = 256;
inline constexpr int kMostRoomsPerPerson = 16, kMostBackupsPerPerson = 64;

// Who asks for a room or a backup, and then owns it.
struct Requester {
  std::string user{};                // from the certificate; empty: unknown, and nothing is counted
  bool may_have_any_number = false;  // of rooms: an operator
};

struct RoomsOptions {
  std::vector<ServedCase> cases;   // at least one; in memory as long as the rooms
  std::filesystem::path folder{};  // of the journals NAME.journal; empty: rooms made here end with the process
  CutLimits limits{};
  std::function<std::shared_ptr<ToolBox>()> tools = builtin_tool_box;  // gives each new room its own tool box
  RuntimeRates rates{};
  Detail detail = Detail::automatic;
  std::shared_ptr<const SigningKeys> keys = nullptr;  // sign the journals; null: not signed
  int retention_days = 0;                             // after which people are erased; 0: never
  std::shared_ptr<AuditTrail> trail = nullptr;        // shared with the server's calls; null: nothing is recorded
  // Stores uploaded cases; shared with uploads in progress. Null: uploads are refused.
  std::shared_ptr<CaseRepository> case_repository{};
  std::uint64_t case_memory_bytes = kMostCaseMemory;  // limit of all cases that rooms use
  int most_rooms = kMostRooms;                        // open and closed ones together; no more are made
  // Of one person: rooms, branches and playbacks together, and backups in the folder.
  int most_rooms_per_person = kMostRoomsPerPerson, most_backups_per_person = kMostBackupsPerPerson;
};

// An open room. Streams and calls share it, so it exists until the last of them has ended.
class OpenRoom {
 public:
  OpenRoom(std::string name, LoadedCase of, Room room, const RoomsOptions& options,
           const std::function<void(double)>& progress, std::unique_ptr<RoomStore> store,
           std::optional<Playback> playback = {});

  const std::string name;
  const LoadedCase of;               // in memory as long as this room
  std::filesystem::path save;        // where the cut fields are written on request; empty: nowhere
  std::string owner;                 // who made a room without a journal; for persisted rooms see Rooms::owner()
  const std::uint64_t server_epoch;  // rises with every opening
  std::optional<std::pair<std::string, RoomSeq>> shows;  // of a playback: which room it shows, and up to where

  [[nodiscard]] RoomRuntime& runtime() { return *runtime_; }
  [[nodiscard]] RoomStore* store() { return store_.get(); }  // null: the room is lost when it is closed
  [[nodiscard]] std::filesystem::path store_file() const { return store_ ? store_->file() : std::filesystem::path{}; }
  // The protocol version of an author's newest join. For an author who never joined, this server's own version.
  void note_version(AuthorId author, std::uint32_t version);
  [[nodiscard]] std::uint32_t version_of(AuthorId author) const;
  [[nodiscard]] Demonstrations& demonstrations() { return demonstrations_; }
  // Ends every stream with this reason.
  void end_streams(const std::string& why);
  // The same, but sessions connect again by themselves.
  void send_away(const std::string& why);
  // Closes the journal cleanly, with a checkpoint. Nothing changes after this.
  RoomSummary close();
  // [maintenance] Writes a checkpoint if the next opening would be slow without it. Erases people whose retention time
  // is over. Moves the journal's log into its file if the room is idle. When `stop` returns true, long work is stopped.
  void maintain(const std::function<bool()>& stop);

 private:
  using Clock = std::chrono::steady_clock;
  mutable Mutex versions_mutex_{LockRank::leaf};
  // Only those that differ from this server's own.
  std::map<AuthorId, std::uint32_t> older_versions_ OSTEON_GUARDED_BY(versions_mutex_);
  std::unique_ptr<RoomStore> store_;  // outlives the runtime, which writes to it
  std::unique_ptr<RoomRuntime> runtime_;
  Demonstrations demonstrations_;                                                  // run in the runtime
  Clock::time_point newest_checkpoint_ = Clock::now(), forgotten_ = Clock::now();  // used by maintenance
};

struct RoomListing {
  std::string name;
  bool open = false;  // people can join it; false for a stopped room, whose journal takes no more entries
  bool kept = false, replay = false;
  Digest case_hash;
  std::string case_title;  // empty: the server does not have that case
  RoomSeq room_seq;        // of an open or stopped room, as are the next two
  std::size_t sessions = 0, watchers = 0;
  std::string parent;  // of a branch or a playback
  RoomSeq parent_room_seq;
};

// Any thread may call it. Functions that make, open, close, copy or delete are slow and run one at a time. Errors:
// not_found (no such room), exists (the name is in use), exhausted (a limit is reached), invalid_input (not a name, or
// a sequence number that the room has not reached), unavailable (closed, or not persisted), and those of RoomStore.
class Rooms {
 public:
  explicit Rooms(RoomsOptions options);
  ~Rooms();
  Rooms(const Rooms&) = delete;
  Rooms& operator=(const Rooms&) = delete;

  // The open room of that name. Without a name, the only open room. The error lists the open rooms.
  [[nodiscard]] Result<std::shared_ptr<OpenRoom>> find(const std::string& name) const;
  [[nodiscard]] std::vector<std::shared_ptr<OpenRoom>> open_rooms() const;  // in order of their names
  [[nodiscard]] std::optional<KnownCase> find_case(const Digest& hash) const { return cases_.find(hash); }
  [[nodiscard]] std::vector<KnownCase> cases() const { return cases_.all(); }
  void add_case(KnownCase known) { cases_.add(std::move(known)); }
  [[nodiscard]] std::uint64_t case_bytes() const { return cases_.loaded_bytes(); }  // memory of all cases
  [[nodiscard]] const std::shared_ptr<AuditTrail>& trail() const { return options_.trail; }
  [[nodiscard]] const std::shared_ptr<CaseRepository>& case_repository() const { return options_.case_repository; }
  [[nodiscard]] std::vector<RoomListing> list() const;

  // Adds a room that was made elsewhere, with its store. `save`: see OpenRoom. `progress` gets the progress of its
  // first surface.
  Result<std::shared_ptr<OpenRoom>> add(const std::string& name, Room room, std::unique_ptr<RoomStore> store,
                                        std::filesystem::path save, const std::function<void(double)>& progress);
  // Opens all rooms that were open when the folder was last left, cleanly or not. Logs those that cannot be opened.
  void resume_all(const std::function<void(double)>& progress);
  // `case_hash` null: the only case.
  Result<std::shared_ptr<OpenRoom>> create(const std::string& name, const Digest* case_hash, const Requester& by = {});
  Result<std::shared_ptr<OpenRoom>> resume(const std::string& name, const std::function<void(double)>& progress = {});
  Result<RoomSummary> close(const std::string& name);
  // Makes a branch of `name` up to that event; null: all of it.
  Result<std::shared_ptr<OpenRoom>> branch(const std::string& name, const std::string& new_name, RoomSeq to,
                                           const Requester& by = {});
  // Replays `name`, which is open, from one event (null: its beginning) to another (null: its last). The replay ends
  // early if that room is closed.
  Result<std::shared_ptr<OpenRoom>> replay(const std::string& name, const std::string& new_name, RoomSeq from,
                                           RoomSeq to, double speed, const Requester& by = {});
  // Reads the entries of a persisted room, open or closed, from its first to `to` (null: all), until `take` returns
  // false. Returns how the room began.
  Result<RoomGenesis> read(const std::string& name, RoomSeq to, const std::function<bool(const LogEntry&)>& take);
  // Begins a demonstration in a room. Errors: those of Demonstrations::begin, and unavailable (the server drains).
  [[nodiscard]] Result<Shown> demonstrate(OpenRoom& in, AuthorId by, const Caller& caller, const WhatToShow& what);
  // Who made a room, or a backup if the name has the ending of backups. Empty: unknown.
  [[nodiscard]] std::string owner(const std::string& name) const;
  // Deletes a room, or a backup by its file's name. Returns the names of everything that was deleted. Before anything
  // is deleted, `may` is asked about the room and each branch that would go too; its error is the result. Error
  // unavailable: the room has branches that shall stay, or its journal is elsewhere.
  Result<std::vector<std::string>> remove(const std::string& name, bool with_branches,
                                          const std::function<Result<void>(const std::string& room)>& may = {});
  // Of an open room, while it is being cut.
  Result<RoomReport> verify(const std::string& name);
  Result<JournalHead> back_up(const std::string& name, const std::string& file_name, std::filesystem::path& file,
                              const Requester& by = {});

  // Admits nobody any more and ends demonstrations. `again`: time after which people who are asked to leave may come
  // again.
  void begin_drain(std::chrono::milliseconds again, const std::string& why);
  [[nodiscard]] std::optional<std::string> draining() const;  // why nobody is admitted
  void begin_end();                                           // stops long work and does no maintenance any more
  [[nodiscard]] bool ending() const { return ending_; }
  // Rooms that are open stay in the folder's list of open rooms.
  [[nodiscard]] std::map<std::string, RoomSummary> close_all();

  // Threads for slow calls, one for each kind, so that a slow call delays only calls of its own kind. Calls that
  // concern one room alone run on that room's thread for slow requests.
  JobThread jobs;  // everything that changes the rooms: one at a time; opening one may take minutes
  // What every client asks for: the lists of rooms and of cases, and a case's files in parts.
  JobThread files;
  // Makes the surfaces of a case's structures and its density, for seconds each. Not `files`: clients that download a
  // case would wait.
  JobThread plans;
  // Reads journals for demonstrations. Reading that of a closed room waits while any room is being changed.
  JobThread recordings;
  JobThread checks;        // uploaded cases; a process checks each, for as long as UploadQuota allows
  void end_calls();        // finishes waiting calls; later ones run on the caller's thread
  RefusalCounts refusals;  // of all calls and connections
  // Checks every call; null: plain text, and everybody may do anything. Outlives the rooms' calls.
  Authorizer* authorizer = nullptr;

 private:
  [[nodiscard]] std::filesystem::path journal_of(const std::string& name) const;
  [[nodiscard]] Result<void> check_new(const std::string& name, const Requester& by) const OSTEON_REQUIRES(changing_);
  [[nodiscard]] Result<void> check_share(const Requester& by) const;
  [[nodiscard]] Result<void> check_free(const std::string& name) const;
  [[nodiscard]] std::size_t count() const;  // of open and persisted rooms
  [[nodiscard]] Result<std::filesystem::path> stored_file(const std::string& name) const;
  Result<std::vector<std::string>> remove_backup(const std::string& name,
                                                 const std::function<Result<void>(const std::string&)>& may);
  Result<std::shared_ptr<OpenRoom>> open(const std::string& name, const LoadedCase& of, bool is_new,
                                         const std::function<void(double)>& progress) OSTEON_REQUIRES(changing_);
  std::shared_ptr<OpenRoom> take_in(std::shared_ptr<OpenRoom> room) OSTEON_REQUIRES(changing_);
  [[nodiscard]] std::shared_ptr<OpenRoom> take_out(const std::string& name) OSTEON_REQUIRES(changing_);
  void note_open() const;  // writes the list of open rooms
  void run_maintenance();
  [[nodiscard]] MaintenanceCalls until_the_end() const;

  const RoomsOptions options_;
  CaseCache cases_;
  // Held by everything that changes the rooms and the folder: one change at a time.
  mutable Mutex changing_{LockRank::rooms_changing};
  mutable Mutex mutex_{LockRank::leaf};
  std::map<std::string, std::shared_ptr<OpenRoom>> open_ OSTEON_GUARDED_BY(mutex_);
  std::optional<std::string> draining_ OSTEON_GUARDED_BY(mutex_);
  // Open when the folder was last left, and not yet open again.
  std::set<std::string> to_open_ OSTEON_GUARDED_BY(mutex_);
  CondVar maintenance_wake_;
  std::atomic<bool> ending_{false};
  std::thread maintenance_;
};

}  // namespace osteon
