// The rooms of one server process: made, opened, closed, branched, shown again, checked, copied and deleted by name.
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/core/result.hpp"
#include "common/tools/tool_box.hpp"
#include "server/audit/audit_trail.hpp"
#include "server/net/case_cache.hpp"
#include "server/net/demonstration.hpp"
#include "server/net/job_thread.hpp"
#include "server/net/refusals.hpp"
#include "server/net/room_files.hpp"
#include "server/net/room_runtime.hpp"
#include "server/net/room_store.hpp"
#include "server/upload_validation/case_repository.hpp"

namespace osteon {

struct Caller;

class Authorizer;

struct RoomSummary {
  Digest case_hash;
  BoneStatus bone;
  RuntimeHealth health;
  std::filesystem::path save;  // where its owner is to write `fields`; empty: nowhere, and they are
  SavedFields fields;
  Digest surface_hash;  // equal to every viewer's that has shown room_seq
};

// Unless somebody says otherwise.
inline constexpr int kMostRooms = 256;
inline constexpr int kMostRoomsPerPerson = 16, kMostBackupsPerPerson = 64;

// Who asks for a room or a backup, and owns it then.
struct Requester {
  std::string user{};                // of the certificate; empty: nobody says who asks, and nothing is counted
  bool may_have_any_number = false;  // of rooms: an operator
};

struct RoomsOptions {
  std::vector<ServedCase> cases;   // at least one; in memory as long as the rooms are
  std::filesystem::path folder{};  // of the journals NAME.journal; empty: rooms made here end with the process
  CutLimits limits{};
  std::function<std::shared_ptr<ToolBox>()> tools = builtin_tool_box;  // that a new room begins with: a box of its own
  RuntimeRates rates{};
  Detail detail = Detail::automatic;
  std::shared_ptr<const SigningKeys> keys = nullptr;  // sign the journals; null: nobody does
  int retention_days = 0;                             // after which it is forgotten who somebody was; 0: never
  std::shared_ptr<AuditTrail> trail = nullptr;        // shared with the server's calls; null: nothing is taken down
  std::shared_ptr<CaseRepository>
      store{};  // where uploaded cases are kept, shared with uploads under way; null: none are taken
  std::uint64_t case_memory_bytes = kMostCaseMemory;  // of all cases that rooms have
  int most_rooms = kMostRooms;                        // open and closed ones together; none is made beyond
  // Of those that one person made: rooms, branches and playbacks together, and backups in the folder.
  int most_rooms_per_person = kMostRoomsPerPerson, most_backups_per_person = kMostBackupsPerPerson;
};

// A room that is open. Streams and calls hold it, so that it is there until the last of them is over.
class OpenRoom {
 public:
  OpenRoom(std::string name, LoadedCase of, Room room, const RoomsOptions& options,
           const std::function<void(double)>& progress, std::unique_ptr<RoomStore> store,
           std::optional<Playback> playback = {});

  const std::string name;
  const LoadedCase of;               // in memory for as long as this is
  std::filesystem::path save;        // where the cut fields are written on request; empty: nowhere
  std::string owner;                 // who made one that is not kept; of one that is kept see Rooms::owner()
  const std::uint64_t server_epoch;  // rises with every opening
  std::optional<std::pair<std::string, RoomSeq>> shows;  // of a playback: which room, up to where

  [[nodiscard]] RoomRuntime& runtime() { return *runtime_; }
  [[nodiscard]] RoomStore* store() { return store_.get(); }  // null: it is lost when it is closed
  [[nodiscard]] std::filesystem::path keeper_file() const { return store_ ? store_->file() : std::filesystem::path{}; }
  // The version of the protocol that an author's newest join was made in; of one who never joined, this server's own.
  void note_version(AuthorId author, std::uint32_t version);
  [[nodiscard]] std::uint32_t version_of(AuthorId author) const;
  [[nodiscard]] Demonstrations& demonstrations() { return demonstrations_; }
  // Tells every stream why it ends.
  void end_streams(const std::string& why);
  // The same; sessions come again by themselves.
  void send_away(const std::string& why);
  // Afterwards nothing changes any more; the journal is closed cleanly, with a checkpoint.
  RoomSummary close();
  // [maintenance] Writes a checkpoint where the next opening would take long without, forgets whom it is time to
  // forget, and cuts the journal's log where the room is idle. `stop` returns true: what takes long is given up.
  void maintain(const std::function<bool()>& stop);

 private:
  using Clock = std::chrono::steady_clock;
  mutable std::mutex versions_mutex_;                 // never held with another
  std::map<AuthorId, std::uint32_t> older_versions_;  // of those that are not this server's own
  std::unique_ptr<RoomStore> store_;                  // outlives the runtime, which writes to it
  std::unique_ptr<RoomRuntime> runtime_;
  Demonstrations demonstrations_;                                                  // in the runtime
  Clock::time_point newest_checkpoint_ = Clock::now(), forgotten_ = Clock::now();  // of maintenance
};

struct RoomListing {
  std::string name;
  bool open = false;  // one can join it: not where it has stopped, whose journal takes no more
  bool kept = false, replay = false;
  Digest case_hash;
  std::string case_title;  // empty: the server has no such case
  RoomSeq room_seq;        // of an open or stopped one, as the next two
  std::size_t sessions = 0, watchers = 0;
  std::string parent;  // of a branch or a playback
  RoomSeq parent_room_seq;
};

// Any thread. What makes, opens, closes, copies or deletes takes long and runs one at a time. Errors: not_found (no
// such room), exists (there is one of that name), exhausted (there are as many as there may be), invalid_input (not a
// name; a place that the room has not reached), unavailable (closed, or not kept), and those of RoomStore.
class Rooms {
 public:
  explicit Rooms(RoomsOptions options);
  ~Rooms();
  Rooms(const Rooms&) = delete;
  Rooms& operator=(const Rooms&) = delete;

  // The open room of that name; without a name the only one that is open. The error says which there are.
  [[nodiscard]] Result<std::shared_ptr<OpenRoom>> find(const std::string& name) const;
  [[nodiscard]] std::vector<std::shared_ptr<OpenRoom>> open_rooms() const;  // in the order of their names
  [[nodiscard]] std::optional<KnownCase> find_case(const Digest& hash) const { return cases_.find(hash); }
  [[nodiscard]] std::vector<KnownCase> cases() const { return cases_.all(); }
  void add_case(KnownCase known) { cases_.add(std::move(known)); }
  [[nodiscard]] std::uint64_t case_bytes() const { return cases_.loaded_bytes(); }  // that cases take in memory
  [[nodiscard]] const std::shared_ptr<AuditTrail>& trail() const { return options_.trail; }
  [[nodiscard]] const std::shared_ptr<CaseRepository>& store() const { return options_.store; }
  [[nodiscard]] std::vector<RoomListing> list() const;

  // A room that was made elsewhere, with its store. `save`: see OpenRoom. `progress` hears how far its first surface
  // is.
  Result<std::shared_ptr<OpenRoom>> add(const std::string& name, Room room, std::unique_ptr<RoomStore> store,
                                        std::filesystem::path save, const std::function<void(double)>& progress);
  // All that were open when the folder was last left, however that was. Those that cannot be opened are logged.
  void resume_all(const std::function<void(double)>& progress);
  // `case_hash` null: of the only case.
  Result<std::shared_ptr<OpenRoom>> create(const std::string& name, const Digest* case_hash, const Requester& by = {});
  Result<std::shared_ptr<OpenRoom>> resume(const std::string& name, const std::function<void(double)>& progress = {});
  Result<RoomSummary> close(const std::string& name);
  // All that `name` was up to that event, null for all.
  Result<std::shared_ptr<OpenRoom>> branch(const std::string& name, const std::string& new_name, RoomSeq to,
                                           const Requester& by = {});
  // Shows `name`, which is open, from one event, null for its beginning, to another, null for its last. It ends early
  // where that room is closed meanwhile.
  Result<std::shared_ptr<OpenRoom>> replay(const std::string& name, const std::string& new_name, RoomSeq from,
                                           RoomSeq to, double speed, const Requester& by = {});
  // The entries of a kept room, open or closed, from its first to `to`, null for all, until `take` returns false; and what
  // it began as.
  Result<RoomGenesis> read(const std::string& name, RoomSeq to, const std::function<bool(const LogEntry&)>& take);
  // Who made a room or, where the name has its ending, a backup; empty: nobody knows.
  [[nodiscard]] std::string owner(const std::string& name) const;
  // Removes a room, or a backup by its file's name. The names of those that are gone. `may` is asked of it and of each
  // branch that would go too, before any does; its error is the result. Error unavailable: it has branches, and they
  // are not to go too; it is kept elsewhere.
  Result<std::vector<std::string>> remove(const std::string& name, bool with_branches,
                                          const std::function<Result<void>(const std::string& room)>& may = {});
  // Of an open room, while it is cut.
  Result<RoomReport> verify(const std::string& name);
  Result<JournalHead> back_up(const std::string& name, const std::string& file_name, std::filesystem::path& file,
                              const Requester& by = {});

  // From now on nobody is let in, and demonstrations are over. `again`: when those who are asked to leave may come
  // again.
  void begin_drain(std::chrono::milliseconds again, const std::string& why);
  [[nodiscard]] std::optional<std::string> draining() const;  // why nobody is let in
  void begin_end();  // gives up what takes long, and does no maintenance any more
  [[nodiscard]] bool ending() const { return ending_; }
  [[nodiscard]] std::map<std::string, RoomSummary> close_all();  // those that are open stay so in the folder's list

  // For calls that take long: a thread for each kind, so that a slow one holds up none but its own. What concerns one
  // room alone runs on that room's thread for slow requests.
  JobThread jobs;   // whatever changes the rooms: one at a time, and opening one may take minutes
  JobThread files;  // what everybody asks for who comes: the lists of rooms and of cases, a case's files piece by piece
  JobThread recordings;    // journals that are read for demonstrations; that of a closed room waits until no room is
                           // being changed
  JobThread checks;        // uploaded cases, each looked through by a process, for as long as UploadQuota lets it
  void end_calls();        // after those that wait; later ones run where they are made
  RefusalCounts refusals;  // of all doors
  Authorizer* authorizer =
      nullptr;  // before every call; null: plain text, and everybody may do anything. It outlives the rooms' calls

 private:
  [[nodiscard]] std::filesystem::path journal_of(const std::string& name) const;
  [[nodiscard]] Result<void> check_new(const std::string& name, const Requester& by) const;  // with changing_
  [[nodiscard]] Result<void> check_share(const Requester& by) const;
  [[nodiscard]] Result<void> check_free(const std::string& name) const;
  [[nodiscard]] std::size_t count() const;  // of open and of kept ones
  [[nodiscard]] Result<std::filesystem::path> kept_file(const std::string& name) const;
  Result<std::vector<std::string>> remove_backup(const std::string& name,
                                                 const std::function<Result<void>(const std::string&)>& may);
  Result<std::shared_ptr<OpenRoom>> open(const std::string& name, const LoadedCase& of, bool is_new,
                                         const std::function<void(double)>& progress);
  std::shared_ptr<OpenRoom> take_in(std::shared_ptr<OpenRoom> room);
  [[nodiscard]] std::shared_ptr<OpenRoom> take_out(const std::string& name);
  void note_open() const;  // writes the list of those that are open
  void run_upkeep();
  [[nodiscard]] MaintenanceCalls until_the_end() const;

  const RoomsOptions options_;
  CaseCache cases_;
  mutable std::mutex changing_;  // held by whatever changes the rooms; taken before mutex_, never within it
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<OpenRoom>> open_;
  std::optional<std::string> draining_;  // under mutex_
  std::set<std::string> to_open_;        // that were open when the folder was last left, and are not yet again
  std::condition_variable upkeep_wake_;
  std::atomic<bool> ending_{false};
  std::thread upkeep_;
};

}  // namespace osteon
