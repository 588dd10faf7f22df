// Stores a room in a journal: writes what it decides, makes the room again from the journal, and maintains the journal
// while it is in use.
#pragma once
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/link/random_bytes.hpp"
#include "server/journal/journal.hpp"
#include "server/journal/maintenance.hpp"
#include "server/room/room.hpp"
#include "server/storage/journal_entries.hpp"
#include "server/storage/room_files.hpp"

namespace osteon {

struct PersistedRoom;

// A mutex that is given in the order of requests. Maintenance takes it again and again, and lets a commit through after
// every slice. Commits let maintenance through in the same way.
class OSTEON_CAPABILITY("mutex") InTurn : core::Ranked {
 public:
  InTurn() : Ranked(LockRank::journal) {}
  void lock() OSTEON_ACQUIRE();
  void unlock() OSTEON_RELEASE();

 private:
  Mutex mutex_{LockRank::leaf};
  CondVar next_;
  std::uint64_t asked_ OSTEON_GUARDED_BY(mutex_) = 0, served_ OSTEON_GUARDED_BY(mutex_) = 0;
};

// Holds a turn while it lives.
class OSTEON_SCOPED_CAPABILITY TurnLock {
 public:
  explicit TurnLock(InTurn& turn) OSTEON_ACQUIRE(turn) : turn_(turn) { turn_.lock(); }
  ~TurnLock() OSTEON_RELEASE() { turn_.unlock(); }
  TurnLock(const TurnLock&) = delete;
  TurnLock& operator=(const TurnLock&) = delete;

 private:
  InTurn& turn_;
};

// The bone after this many entries were applied to it: Room::room_seq() and Room::field_hash().
struct BoneAt {
  RoomSeq seq;
  Digest field_hash{};
};

// Decides when the next checkpoint is due. Evaluating a cut again takes a tenth of a millisecond, with a large tool one
// or two milliseconds. So the next opening takes a few seconds at most. Every checkpoint contains all leaves of the
// bone. So there is a least time between two, as a bone that is cut fast would otherwise be written all the time.
struct CheckpointPolicy {
  std::uint64_t changes = 2000;
  std::chrono::nanoseconds apart = std::chrono::seconds(60);
  [[nodiscard]] bool is_due(std::uint64_t changes_since, std::chrono::nanoseconds since) const {
    return changes_since >= changes && since >= apart;
  }
};

// The result of checking an open room's journal.
struct RoomReport {
  JournalHead head;                  // of the last entry that the chain confirms; its sequence number is their count
  std::optional<RoomSeq> first_bad;  // the first bad entry
  std::size_t checkpoints = 0;       // their bytes and fields were confirmed
  BoneAt replayed;                   // computed from the entries alone; sequence number 0: not asked for
  std::vector<std::string> faults;   // one sentence each
  [[nodiscard]] bool sound() const { return faults.empty(); }
};

// The time at which a reopened room continues. Nobody knows how long the room was closed, and its clients worked on
// meanwhile. Without any answer they work on for two seconds. If they received anything else, they go on up to the most
// cuts that they leave unconfirmed (3.6 s). These cuts arrive when the room is open again, and the time that they took
// must have passed by then.
inline constexpr std::chrono::nanoseconds kTimeAway = std::chrono::seconds(4);
[[nodiscard]] std::chrono::nanoseconds reopened_time(const Room& room);

// Any thread may call it. Long work holds the journal for one slice of entries at a time; entries are written between
// slices. After close() every function returns the error unavailable.
class RoomStore {
 public:
  struct Options {
    std::string name = "room";  // of a new room
    CutLimits limits;
    std::shared_ptr<ToolBox> tools;  // that a new room begins with; null: the built-in ones
    JournalOptions journal;
    int retention_days = 0;               // who joined more days ago is erased; 0: nobody is
    std::function<std::int32_t()> today;  // days since 1970-01-01; null: by the computer's clock
    FillRandom random;                    // for the key of its witnesses; null: the system's
  };
  // Continues the journal's room up to the last entry that anybody was sent. Makes a new room if the file does not
  // exist. `progress` gets the fraction of the entries replayed. Errors: those of Journal::open; unsupported (from
  // another case, kernel or release); invalid_input (impossible entries: use salvage). A journal that is closed to
  // entries still gives its room, which takes no more entries.
  [[nodiscard]] static Result<PersistedRoom> open(const std::filesystem::path& file, const Case& bone,
                                                  const Options& options,
                                                  const std::function<void(double)>& progress = {});

  // For a Committer. Returns when the entries are durable. Sequence numbers continue from the last entry.
  [[nodiscard]] Result<void> write(std::span<const LogEntry> entries);
  [[nodiscard]] JournalHead head() const;  // after close(): the last one
  // Why the journal takes no more entries, for good: damage, a failed write, or a witness that knows more. Null: it
  // takes entries. Never waits.
  [[nodiscard]] const Error* closed_to_entries() const { return closed_to_entries_; }
  // Rises with every opening.
  [[nodiscard]] std::uint64_t server_epoch() const { return server_epoch_; }
  // Entries that were evaluated again at opening.
  [[nodiscard]] std::uint64_t evaluated() const { return evaluated_; }
  [[nodiscard]] const RoomGenesis& genesis() const { return genesis_; }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  // The witness of the current head, as it is sent to clients.
  [[nodiscard]] Witness witness() const;
  // Checks the witness that a client was sent: see Journal::check_witness. A witness beyond the journal counts only
  // with the journal's seal, so that no client can close a room with invented numbers. The error is a sentence for the
  // client's person: how many events the room has lost, or that it begins anew, and what to do. Error invalid_input:
  // also for a missing seal.
  [[nodiscard]] Result<void> check_witness(const Witness& witness);

  // The pseudonym of this person in entries. The same label gives the same number until the person is erased.
  [[nodiscard]] Result<std::uint32_t> person(const std::string& label);
  [[nodiscard]] Result<std::vector<Person>> people();
  // Erases who a person is, here and not in copies. What the person did stays, under the number. Returns false if
  // nobody has that number.
  [[nodiscard]] Result<bool> erase_person(std::uint32_t person);
  // Erases everybody who joined too long ago for Options::retention_days, as open() does. Call it once a day. Returns
  // how many.
  [[nodiscard]] Result<std::size_t> erase_old_people();
  // Exports everything about a person: a line of JSON that says who it is, then a line for each of the person's events,
  // until `take` returns false. Error not_found: no event and no name has that number.
  [[nodiscard]] Result<void> export_person(std::uint32_t person, const std::function<bool(const std::string&)>& take);

  // Reads entries from `from` to `to`, both included, or to the current head, until `take` returns false. Each entry is
  // checked against the chain. `take` may wait, so an open room can be replayed while it is cut. Errors: those of the
  // first entry that does not fit.
  [[nodiscard]] Result<void> read(RoomSeq from, RoomSeq to, const std::function<bool(const LogEntry&)>& take);
  // Checks every entry up to the current head against the chain. Checks the bytes of every checkpoint against their
  // digest, its fields against their hash, and all other witnesses. `live` is a durable sequence number with its bone.
  // With it, the entries are also replayed into a fresh room of this case up to there, and the bones are compared. This
  // takes as long as all its cuts. Damage is described in the report. Errors: unavailable (`live` is beyond the head),
  // cancelled, unsupported (another case).
  [[nodiscard]] Result<RoomReport> verify(const Case& bone, const std::optional<BoneAt>& live,
                                          const MaintenanceCalls& calls = {});
  // Copies the journal as it is now, with its people and checkpoints. The copy is complete or does not exist. Returns
  // its head. Errors: exists (something is in `to`), invalid_input (damaged: nothing is copied), cancelled.
  [[nodiscard]] Result<JournalHead> backup(const std::filesystem::path& to, const MaintenanceCalls& calls = {});
  // As branch_journal().
  [[nodiscard]] Result<JournalHead> branch(const std::filesystem::path& to, RoomSeq seq, const std::string& name,
                                           const MaintenanceCalls& calls = {});

  // Whether this head is in the journal's history. For branches_of().
  [[nodiscard]] Result<bool> has_head(const JournalHead& head);

  // Writes all leaves of the room as they were at `seq`, so that the next opening need not evaluate every cut again.
  // Entries may have come since. The leaves are written and synced in parts, and noted in their own transaction. Does
  // nothing if the entries up to there are not durable yet, or if a checkpoint already reaches that far. Error
  // cancelled.
  [[nodiscard]] Result<void> checkpoint(RoomSeq seq, std::span<const FieldLeaf> leaves,
                                        const MaintenanceCalls& calls = {});
  // Entries since the newest checkpoint that the next opening would evaluate. For CheckpointPolicy.
  [[nodiscard]] std::uint64_t changes_since_checkpoint() const;
  // Moves the journal's log into its file if no entry has come since the last call. Call it every few seconds.
  [[nodiscard]] Result<void> tidy_if_idle();
  // Closes the journal cleanly. Stops long work, but waits for a checkpoint that is being written.
  [[nodiscard]] Result<void> close();

 private:
  RoomStore(std::filesystem::path file, Journal journal, RoomGenesis genesis, double pitch_mm, Disk& disk);
  // Fields of the newest readable checkpoint; empty if there is none.
  struct Fields {
    RoomSeq seq;
    std::vector<FieldLeaf> leaves;
  };
  // Reads leaves and their hash from a checkpoint's bytes. Error invalid_input.
  [[nodiscard]] Result<std::vector<FieldLeaf>> fields_of(const Checkpoint& one, std::string_view bytes) const;
  // Numbers this opening of the journal.
  [[nodiscard]] Result<void> begin(const Options& options);
  // The room at the journal's head.
  [[nodiscard]] Result<Room> evaluate(const Case& bone, const CutLimits& limits,
                                      const std::function<void(double)>& progress);
  [[nodiscard]] Fields newest_fields() OSTEON_REQUIRES(turn_);
  [[nodiscard]] Result<Room> replay(const Case& bone, const CutLimits& limits, const Fields& fields,
                                    const std::function<void(double)>& progress) OSTEON_REQUIRES(turn_);
  // Uses the journal in turn. Error unavailable: the journal is closed.
  template <class Do>
  auto with_journal(const Do& what) -> decltype(what(std::declval<Journal&>())) {
    const TurnLock in_turn(turn_);
    if (!journal_) return is_closed();
    auto done = what(*journal_);
    note_closing();
    return done;
  }
  void note_closing() OSTEON_REQUIRES(turn_);
  [[nodiscard]] tl::unexpected<Error> is_closed() const;
  // The first opening that finds no such register makes it.
  [[nodiscard]] Result<void> find_witness_key(const Options& options) OSTEON_REQUIRES(turn_);
  [[nodiscard]] Digest seal_of(const JournalHead& head) const;
  // Entries after `at` up to `last`; `at` moves on with them. Error invalid_input: the entry after `at` does not fit
  // the chain.
  [[nodiscard]] Result<void> each_entry(JournalHead& at, RoomSeq last,
                                        const std::function<bool(const JournalEntry&)>& take);
  [[nodiscard]] Result<void> run(JournalCopy& copy, const MaintenanceCalls& calls);
  // Checks a checkpoint's bytes. Finds nothing wrong if a newer checkpoint has replaced it in the meantime.
  [[nodiscard]] Result<void> check_bytes(const Checkpoint& one, RoomReport& report);

  Mutex checkpointing_{LockRank::checkpoint};  // held while a checkpoint is written; guards its file
  std::atomic<bool> closing_ = false;
  mutable InTurn turn_;
  std::optional<Journal> journal_ OSTEON_GUARDED_BY(turn_);  // nothing: closed
  JournalHead last_ OSTEON_GUARDED_BY(turn_);                // the head at closing
  std::optional<Error> why_closed_to_entries_;               // set once in turn, before the pointer below to it
  std::atomic<const Error*> closed_to_entries_ = nullptr;
  const std::filesystem::path file_;
  const RoomGenesis genesis_;
  const double pitch_mm_;
  Disk& disk_;
  int retention_days_ = 0;
  std::function<std::int32_t()> today_;
  std::string witness_key_;
  std::vector<RoomSeq> changes_ OSTEON_GUARDED_BY(turn_);  // since the newest checkpoint
  std::optional<RoomSeq> idle_at_;                         // the head at the last call of tidy_if_idle()
  std::uint64_t server_epoch_ = 0, evaluated_ = 0;
};

struct PersistedRoom {
  Room room;
  std::unique_ptr<RoomStore> store;
  bool made = false;  // true: there was no journal before
};

}  // namespace osteon
